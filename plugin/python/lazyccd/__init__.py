"""LazyCCD: exact continuous collision detection, and a collision backend for PyBullet's soft bodies.

- `Detector`: every contact of a step of moving meshes.
- `lazyccd.queries`: single elementary tests, many at once.
- `lazyccd.pybullet`: gives PyBullet's soft and deformable worlds LazyCCD's contacts.
- `view`: a mesh and its contacts in a window or a notebook.
- `lazyccd.sweep`: parameter sweeps on many cores or machines.
"""

from . import queries
from .detector import Detector, contact_hash
from .errors import Error
from .records import EDGE_EDGE, VERTEX_FACE, bodies, body_dtype, contact_dtype, weights
from .viewer import contact_points, view

__all__ = [
    "Detector",
    "EDGE_EDGE",
    "Error",
    "VERTEX_FACE",
    "bodies",
    "body_dtype",
    "contact_dtype",
    "contact_hash",
    "contact_points",
    "queries",
    "view",
    "weights",
]
