"""Arrays in the layouts that C++ takes. Copies only what has another type or layout."""

from __future__ import annotations

from typing import Any, NamedTuple

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


class DevicePositions(NamedTuple):
    """Positions in device memory: the address of the first, their number, and bytes between two."""

    address: int
    count: int
    stride: int
    is_double: bool


def _device_interface(values: Any, name: str) -> dict:
    interface = getattr(values, "__cuda_array_interface__", None)
    if interface is None:
        raise TypeError(f"{name} has no __cuda_array_interface__: it is not in device memory")
    return interface


def device_positions(values: Any, name: str) -> DevicePositions:
    """Positions of float32 or float64 and shape (n, 3), in rows, in device memory."""
    interface = _device_interface(values, name)
    shape, kind = tuple(interface["shape"]), interface["typestr"]
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"{name} has shape {shape}; (n, 3) is needed")
    if kind not in ("<f4", "<f8"):
        raise TypeError(f"{name} has type {kind}; float32 or float64 is needed")
    size = int(kind[2])
    row, column = interface.get("strides") or (3 * size, size)
    if shape[0] > 0 and (column != size or row < 3 * size or row % size != 0):
        raise ValueError(f"{name} has strides {(row, column)}; the three numbers of a row must be side by side")
    return DevicePositions(int(interface["data"][0] or 0), shape[0], row, size == 8)


def device_bytes(values: Any, count: int, name: str) -> int:
    """The address of an array of at least `count` bytes or truth values, shape (n,), in device memory."""
    interface = _device_interface(values, name)
    if len(interface["shape"]) != 1 or interface["typestr"][1:] not in ("b1", "u1", "i1"):
        raise TypeError(f"{name} is not an array of bytes and shape (n,)")
    if tuple(interface.get("strides") or (1,)) != (1,):
        raise ValueError(f"{name} is not contiguous")
    if interface["shape"][0] < count:
        raise ValueError(f"{name} has {interface['shape'][0]} entries; {count} are needed")
    return int(interface["data"][0] or 0)
