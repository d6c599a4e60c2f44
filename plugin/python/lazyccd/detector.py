"""The detector: finds every contact of a step in continuous time."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from . import _native, arrays
from .device import DeviceContacts
from .records import body_dtype, contact_dtype


class Detector:
    """Finds every vertex-face and edge-edge contact of meshes that move linearly over a step.

    Every contact is decided by certified arithmetic: none is missed, and results do not depend on threads,
    instruction set or backend.

        detector = lazyccd.Detector(faces)
        for start, end in steps:
            contacts = detector.detect(start, end)

    Several detectors may work at the same time. Calls of one detector wait for each other.

    Args:
        faces: integers, shape (f, 3): three vertex indices of each triangle. Their sides become edges.
        edges: integers, shape (e, 2): edges that are no side of a face (ropes).
        vertex_count: number of vertices. Default: the least that the arrays need.
        body_of_vertex: integers, shape (n,): index of the body of each vertex. Default: one body.
        inverse_mass: shape (n,), 1/kg; 0: pinned. Pairs of four pinned vertices are not reported.
        self_separation: shape (n,), unit of the positions: limit of the separation within one body. That of two
            primitives is min(separation, max over one's vertices, max over the other's), but not below 2**-10
            of the separation. Default: no limit.
        bodies: filters of the bodies, from `lazyccd.bodies`. Default: all collide.
        disabled_pairs: integers, shape (p, 2): pairs of bodies that do not collide.
        backend: ``auto`` (the faster one, by measured times, if the package was built with CUDA and a device
            answers; otherwise the CPU), ``cpu`` or ``cuda``.
        threads: threads of the CPU backend; 0: as many as there are cores.
        vertex_face: whether vertices are tested against faces.
        edge_edge: whether edges are tested against edges.
        separation: minimum separation, in the unit of the positions. A contact is where the distance falls to
            this value, or is below it at the start. 0: primitives must touch.
        reduce_contacts: report one contact if several pairs share the same closest points at the start.
        strategy: how the traversal shares its work, by its C++ name. Changes the cost, never the contacts.
        volume: bounding volume of the hierarchy: ``box``, ``dop18`` or ``oriented_box``. Likewise.
        device: index of the GPU, as CUDA numbers them; -1: the current one.

    Raises:
        lazyccd.Error: the topology is invalid; names body and primitive. Or an option is out of its range.
    """

    def __init__(
        self,
        faces: Any,
        *,
        edges: Any = None,
        vertex_count: Optional[int] = None,
        body_of_vertex: Any = None,
        inverse_mass: Any = None,
        self_separation: Any = None,
        bodies: Optional[np.ndarray] = None,
        disabled_pairs: Any = None,
        backend: str = "auto",
        threads: int = 0,
        vertex_face: bool = True,
        edge_edge: bool = True,
        separation: float = 0.0,
        reduce_contacts: bool = False,
        strategy: str = "lazy_stealing",
        volume: str = "box",
        device: int = -1,
    ) -> None:
        self._native = _native.Detector(
            backend,
            threads,
            vertex_face,
            edge_edge,
            separation,
            reduce_contacts,
            strategy,
            volume,
            device,
        )
        self.set_topology(
            faces,
            edges=edges,
            vertex_count=vertex_count,
            body_of_vertex=body_of_vertex,
            inverse_mass=inverse_mass,
            self_separation=self_separation,
            bodies=bodies,
            disabled_pairs=disabled_pairs,
        )

    def set_topology(
        self,
        faces: Any,
        *,
        edges: Any = None,
        vertex_count: Optional[int] = None,
        body_of_vertex: Any = None,
        inverse_mass: Any = None,
        self_separation: Any = None,
        bodies: Optional[np.ndarray] = None,
        disabled_pairs: Any = None,
    ) -> None:
        """Replaces the topology. Arguments as of the class; they are copied.

        Raises:
            lazyccd.Error: the topology is invalid; the old one stays.
        """
        face_array = arrays.indices(faces, 3, "faces")
        edge_array = arrays.indices(edges, 2, "edges")
        body_array = arrays.indices(body_of_vertex, 1, "body_of_vertex")
        masses = arrays.floats(inverse_mass, "inverse_mass")
        limits = arrays.floats(self_separation, "self_separation")
        if vertex_count is None:
            largest = [int(a.max()) + 1 for a in (face_array, edge_array) if a.size > 0]
            vertex_count = max([*largest, len(body_array), len(masses), len(limits), 0])
        filters = np.ascontiguousarray(np.zeros(0, body_dtype) if bodies is None else bodies)
        if filters.dtype != body_dtype or filters.ndim != 1:
            raise TypeError("bodies is not an array that lazyccd.bodies() makes")
        self._native.set_topology(
            vertex_count,
            face_array,
            edge_array,
            body_array,
            masses,
            limits,
            filters.view(np.uint8).reshape(-1, body_dtype.itemsize),
            arrays.indices(disabled_pairs, 2, "disabled_pairs"),
        )
        # Bodies without a filter are in world 0.
        self._world_count = int(filters["world"].max()) + 1 if len(filters) > 0 else 1

    def detect(self, start: Any, end: Any) -> np.ndarray:
        """Returns the contacts of the linear motion from `start` to `end`.

        Other Python threads run meanwhile. They must not change the two arrays.

        Args:
            start: positions at the start of the step, shape (n, 3), any unit. float32 and float64 are read
                where they are, with any distance between rows; everything else is converted to float64.
            end: positions at the end of the step, likewise.

        Returns:
            Array of shape (contacts,) and type `lazyccd.contact_dtype`, sorted by world, bodies, kind and primitives. It
            owns the memory that C++ wrote, and stays valid.

        Raises:
            lazyccd.Error: a position is not finite, or the number of positions is wrong.
        """
        found = self._native.detect(
            arrays.positions(start, "start"), arrays.positions(end, "end")
        )
        return found.view(contact_dtype)

    def detect_async(
        self, start: Any, end: Any, *, stream: int = 0, world_mask: Any = None
    ) -> DeviceContacts:
        """Enqueues a detection of arrays in device memory, and returns before it is done.

        Nothing is copied to the host. Arrays of PyTorch, CuPy, JAX, Numba and Warp will do.

        Args:
            start: positions at the start of the step, shape (n, 3), float32 or float64, an object with
                ``__cuda_array_interface__``. Rows may have any distance. Must be unchanged until the device
                has read it.
            end: positions at the end of the step, likewise, of the same type.
            stream: handle of the CUDA stream (``torch.cuda.current_stream().cuda_stream``); 0: the default.
            world_mask: one byte for each world, in device memory: bodies of a world with 0 are left out. Their
                positions may be anything.

        Returns:
            The contacts in device memory, valid until the next call. What is enqueued on `stream` afterwards
            finds them.

        Raises:
            lazyccd.Error: there is no GPU, or a separation is set.
        """
        first, last = arrays.device_positions(start, "start"), arrays.device_positions(end, "end")
        if first.count != last.count or first.is_double != last.is_double:
            raise ValueError("start and end have different shapes or types")
        mask = 0 if world_mask is None else arrays.device_bytes(world_mask, self._world_count, "world_mask")
        found = self._native.detect_async(
            first.address, first.stride, last.address, last.stride, first.count, first.is_double, stream, mask
        )
        return DeviceContacts(self._native, *found)

    def synchronize(self) -> DeviceContacts:
        """Waits for the last `detect_async` and completes its contacts, if something had no room.

        Raises:
            lazyccd.Error: a position is not finite, or the device failed.
        """
        return DeviceContacts(self._native, *self._native.synchronize())

    def download_contacts(self) -> np.ndarray:
        """Does the same and returns the contacts as `detect` does."""
        return self._native.download_contacts().view(contact_dtype)

    @property
    def edges(self) -> np.ndarray:
        """All edges, shape (e, 2): the sides of the faces and the edges that were given, each once."""
        return self._native.edges

    @property
    def stats(self) -> _native.Stats:
        """Counters and times of the last detection."""
        return self._native.stats

    @property
    def status(self) -> str:
        """One line: the backend in use and, if it is not the one asked for, why."""
        return self._native.status


def contact_hash(contacts: np.ndarray) -> int:
    """Returns a 64-bit hash over kind, vertices and time of impact. Does not depend on the order."""
    if contacts.dtype != contact_dtype:
        raise TypeError("contacts is not an array of lazyccd.contact_dtype")
    records = np.ascontiguousarray(contacts)
    return _native.contact_hash(records.view(np.uint8).reshape(-1, contact_dtype.itemsize))
