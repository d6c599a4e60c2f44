"""Looks at a mesh and its contacts, by polyscope: `pip install lazyccd[view]`."""

from __future__ import annotations

import io
import os
import sys
from typing import Any, Optional, Tuple

import numpy as np

from .records import VERTEX_FACE, contact_dtype, weights


class Picture:
    """What the window would show. A notebook draws it."""

    def __init__(self, pixels: np.ndarray):
        self.pixels = pixels
        """uint8, shape (height, width, 4): red, green, blue, opacity."""

    def save(self, path: str) -> None:
        """Writes a picture file; its name decides the format."""
        self._image().save(path)

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self._image().save(file, "png")
        return file.getvalue()

    def _image(self) -> Any:
        from PIL import Image

        return Image.fromarray(self.pixels[:, :, :3])


def contact_points(start: Any, end: Any, contacts: np.ndarray) -> np.ndarray:
    """Returns the points on body b at the times of impact, shape (n, 3), unit of the positions.

    Args:
        start, end: positions as in `Detector.detect`.
        contacts: an array of `lazyccd.contact_dtype`.
    """
    first, last = np.asarray(start, np.float64), np.asarray(end, np.float64)
    vertices, toi = contacts["vertices"], contacts["toi"][:, None, None]
    at_impact = (1 - toi) * first[vertices] + toi * last[vertices]
    shares = -weights(contacts)
    shares[:, 0] = 0  # the vertex, or edge a's two, are body a's
    shares[contacts["kind"] != VERTEX_FACE, 1] = 0
    return (shares[:, :, None] * at_impact).sum(axis=1)


def _touched_faces(triangles: np.ndarray, vertex_count: int, contacts: np.ndarray) -> np.ndarray:
    def keys(pairs: np.ndarray) -> np.ndarray:
        return pairs.min(axis=-1).astype(np.int64) * vertex_count + pairs.max(axis=-1)

    is_face = contacts["kind"] == VERTEX_FACE
    edges = keys(contacts["vertices"][~is_face].reshape(-1, 2))
    sides = np.stack([keys(triangles[:, pair]) for pair in ([0, 1], [1, 2], [2, 0])], axis=1)
    touched = np.isin(sides, edges).any(axis=1)
    touched[contacts["primitive_b"][is_face]] = True
    return touched


def view(
    faces: Any,
    start: Any,
    end: Any = None,
    contacts: Optional[np.ndarray] = None,
    *,
    window: Optional[bool] = None,
    size: Tuple[int, int] = (800, 600),
    up: str = "z_up",
) -> Optional[Picture]:
    """Shows a mesh and its contacts. The faces that have contacts are red.

    Args:
        faces: integers, shape (f, 3), as in `lazyccd.Detector`.
        start: positions, shape (n, 3).
        end: positions at the end of the step; the mesh is drawn there, and where it was at the start as wires.
        contacts: what `Detector.detect` returned for this step, or `lazyccd.pybullet.contacts`. Points are drawn
            with their normals, coloured by time of impact.
        window: true: opens a window and returns when it is closed. False: returns a picture. Default: a picture
            in a notebook or without a display, otherwise a window.
        size: width and height in pixels.
        up: direction that is up: ``x_up``, ``y_up`` or ``z_up``.

    Raises:
        ImportError: polyscope is not installed.
    """
    import polyscope as ps

    triangles, first = np.asarray(faces), np.asarray(start, np.float64)
    last = first if end is None else np.asarray(end, np.float64)
    if window is None:
        window = "ipykernel" not in sys.modules and (sys.platform != "linux" or "DISPLAY" in os.environ)
    if not ps.is_initialized():
        ps.set_verbosity(0)
        ps.set_allow_headless_backends(True)
        ps.set_SSAA_factor(2)
        ps.init()
    ps.set_window_size(*size)
    ps.set_up_dir(up)
    ps.set_ground_plane_mode("none")
    ps.remove_all_structures()

    mesh = ps.register_surface_mesh("mesh", last, triangles, edge_width=0.5)
    if end is not None:
        edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        ps.register_curve_network("start of the step", first, edges, radius=0.0005, color=(0.6, 0.6, 0.6))
    if contacts is not None and len(contacts):
        is_detectors = contacts.dtype == contact_dtype
        points = contact_points(first, last, contacts) if is_detectors else contacts["point"]
        cloud = ps.register_point_cloud("contacts", points, radius=0.004)
        cloud.add_vector_quantity("normal", contacts["normal"], enabled=True, color=(0.1, 0.1, 0.1), length=0.03, radius=0.002)
        cloud.add_scalar_quantity("time of impact", contacts["toi"], enabled=True)
        if is_detectors:
            touched = _touched_faces(triangles, len(first), contacts)
            colours = np.where(touched[:, None], (0.85, 0.25, 0.2), (0.45, 0.6, 0.85))
            mesh.add_color_quantity("touched", colours, defined_on="faces", enabled=True)
    corners = np.concatenate([first, last])
    middle, extent = (corners.min(axis=0) + corners.max(axis=0)) / 2, np.ptp(corners, axis=0).max()
    side = {"x_up": (0.75, 0.8, -1.1), "y_up": (0.8, 0.75, 1.1), "z_up": (0.8, -1.1, 0.75)}[up]
    ps.look_at(middle + extent * np.array(side), middle)
    if window:
        ps.show()
        return None
    return Picture(np.array(ps.screenshot_to_buffer(transparent_bg=False)))
