"""The exception of the package."""

from __future__ import annotations

from typing import Optional


class Error(RuntimeError):
    """An error that the detector found.

    Attributes:
        code: class of the error: ``invalid_argument``, ``non_finite_position``, ``index_out_of_range``,
            ``degenerate_face``, ``duplicate_face``, ``mixed_body``, ``empty_body``, ``size_mismatch``,
            ``unavailable`` or ``device``.
        body: index of the body at fault, or None.
        primitive: index of the vertex, edge or face at fault, or None. The message names the kind.
    """

    def __init__(
        self,
        message: str,
        code: str = "invalid_argument",
        body: Optional[int] = None,
        primitive: Optional[int] = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.body = body
        self.primitive = primitive
