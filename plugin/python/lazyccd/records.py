"""Record types of arrays that Python and C++ share."""

from __future__ import annotations

import numpy as np

VERTEX_FACE = 0
"""Value of a contact's ``kind``: a vertex touches a face."""
EDGE_EDGE = 1
"""Value of a contact's ``kind``: an edge touches an edge."""

contact_dtype = np.dtype(
    [
        ("kind", np.int32),
        ("body_a", np.int32),
        ("body_b", np.int32),
        ("primitive_a", np.int32),
        ("primitive_b", np.int32),
        ("vertices", np.int32, 4),
        ("u", np.float32),
        ("v", np.float32),
        ("normal", np.float32, 3),
        ("toi", np.float64),
    ]
)
"""One contact, 64 bytes.

- ``kind``: VERTEX_FACE or EDGE_EDGE.
- ``body_a``, ``body_b``: indices of the bodies.
- ``primitive_a``: the vertex, or the index of edge a in ``Detector.edges``.
- ``primitive_b``: the face, or the index of edge b.
- ``vertices``: the vertex and the face's three; or edge a's two and edge b's two.
- ``u``, ``v``: the contact point at the time of impact. Vertex-face: barycentric coordinates of face vertices
  1 and 2. Edge-edge: parameters along edge a and along edge b, 0 to 1.
- ``normal``: unit vector from b towards a.
- ``toi``: time of impact, 0 (start of the step) to 1 (end).
"""

body_dtype = np.dtype(
    {
        "names": ["group", "mask", "self_collision", "layer", "layer_mask", "world"],
        "formats": [np.uint32, np.uint32, np.bool_, np.uint32, np.uint32, np.int32],
        "offsets": [0, 4, 8, 12, 16, 20],
        "itemsize": 24,
    }
)
"""Collision filter and world of one body; see `bodies`."""


def bodies(count: int) -> np.ndarray:
    """Returns the filters of `count` bodies that all collide with each other and with themselves.

    Two different bodies A and B collide if all of these are nonzero: ``A.group & B.mask``,
    ``B.group & A.mask``, ``A.layer & B.layer_mask`` and ``B.layer & A.layer_mask``. Besides, they must be in the
    same ``world``, or one of them in every world (-1). Worlds may be at the same place in space.

    Returns:
        Array of shape (count,) and type `body_dtype`. Change its fields, then hand it to `Detector`.
    """
    filters = np.zeros(count, body_dtype)
    filters["group"] = filters["layer"] = 1
    filters["mask"] = filters["layer_mask"] = 0xFFFFFFFF
    filters["self_collision"] = True
    return filters


def weights(contacts: np.ndarray) -> np.ndarray:
    """Returns the weights of the four vertices of each contact, an array of shape (n, 4).

    They sum to zero. ``(weights[:, :, None] * x[vertices]).sum(1)`` is the vector from the contact point on b
    to that on a.
    """
    u = contacts["u"].astype(np.float64)
    v = contacts["v"].astype(np.float64)
    face = np.stack([np.ones_like(u), -(1 - u - v), -u, -v], axis=1)
    edge = np.stack([1 - u, u, -(1 - v), -v], axis=1)
    return np.where((contacts["kind"] == VERTEX_FACE)[:, None], face, edge)
