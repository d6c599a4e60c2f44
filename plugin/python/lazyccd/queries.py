"""Elementary tests without a scene: two primitives over one step, many pairs at once.

Exact for any finite input: no tolerance, no wrong answer.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _native
from .records import EDGE_EDGE, VERTEX_FACE


class Results(NamedTuple):
    """Answers to n queries."""

    hit: np.ndarray
    """bool, shape (n,): whether the two primitives touch."""
    toi: np.ndarray
    """float64, shape (n,): time of impact, 0 (start of the step) to 1 (end); 0 without a hit."""


def vertex_face(start: Any, end: Any, separation: float = 0.0, threads: int = 0) -> Results:
    """Decides for each query whether a vertex touches a face while the four points move linearly.

    Args:
        start: points at the start of the step, shape (n, 4, 3): the vertex, then the three of the face.
        end: the same points at the end of the step.
        separation: distance that counts as a contact, in the unit of the points. With a separation, a distance
            that rounding cannot tell from it counts as a contact.
        threads: threads that share the queries; 0: as many as there are cores.

    Raises:
        lazyccd.Error: a point is not finite, or the separation is negative or not finite.
    """
    return _decide(VERTEX_FACE, start, end, separation, threads)


def edge_edge(start: Any, end: Any, separation: float = 0.0, threads: int = 0) -> Results:
    """As `vertex_face`, for two edges: the two points of edge a, then the two of edge b."""
    return _decide(EDGE_EDGE, start, end, separation, threads)


def _decide(kind: int, start: Any, end: Any, separation: float, threads: int) -> Results:
    first = np.ascontiguousarray(start, np.float64)
    last = np.ascontiguousarray(end, np.float64)
    if first.ndim != 3 or first.shape[1:] != (4, 3) or first.shape != last.shape:
        raise ValueError(f"start and end have shapes {first.shape} and {last.shape}; (n, 4, 3) is needed")
    hit = np.empty(len(first), np.uint8)
    toi = np.empty(len(first), np.float64)
    _native.decide(kind, first, last, separation, threads, hit, toi)
    return Results(hit.view(np.bool_), toi)
