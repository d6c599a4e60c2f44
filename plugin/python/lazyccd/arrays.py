"""Arrays in the layouts that C++ takes. Copies only what has another type or layout."""

from __future__ import annotations

from typing import Any

import numpy as np


def indices(values: Any, columns: int, name: str) -> np.ndarray:
    """An array of int32 and shape (n, columns), or (n,) if `columns` is 1."""
    array = np.asarray([] if values is None else values)
    if array.size == 0:
        return np.empty((0, columns) if columns > 1 else 0, np.int32)
    if array.ndim != (2 if columns > 1 else 1) or (columns > 1 and array.shape[1] != columns):
        shape = f"(n, {columns})" if columns > 1 else "(n,)"
        raise ValueError(f"{name} has shape {array.shape}; {shape} is needed")
    if not np.issubdtype(array.dtype, np.integer):
        raise TypeError(f"{name} has type {array.dtype}; integers are needed")
    limits = np.iinfo(np.int32)
    if array.dtype != np.int32 and (array.min() < limits.min or array.max() > limits.max):
        raise ValueError(f"{name} has a number that does not fit 32 bits")
    return np.ascontiguousarray(array, np.int32)


def floats(values: Any, name: str) -> np.ndarray:
    """An array of float32 and shape (n,)."""
    array = np.ascontiguousarray([] if values is None else values, np.float32)
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}; (n,) is needed")
    return array


def positions(values: Any, name: str) -> np.ndarray:
    """An array of float32 or float64 and shape (n, 3) whose rows are contiguous."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} has shape {array.shape}; (n, 3) is needed")
    if array.dtype not in (np.float32, np.float64):
        array = array.astype(np.float64)
    row, column = array.strides
    size = array.itemsize
    if column != size or row < 3 * size or row % size != 0 or not array.flags.aligned:
        array = np.ascontiguousarray(array)
    return array
