"""Contacts in device memory, for PyTorch, CuPy, JAX and others, without a copy."""

from __future__ import annotations

from typing import Any, Tuple

from . import _native
from .records import contact_dtype


class DeviceArray:
    """An array in device memory that belongs to a detector.

    Exports itself through DLPack (``torch.from_dlpack(array)``) and the CUDA array interface
    (``cupy.asarray(array)``). Valid until the next call of the detector.
    """

    def __init__(
        self, owner: Any, address: int, shape: Tuple[int, ...], strides: Tuple[int, ...], type: str, device: int
    ) -> None:
        # type: as in the CUDA array interface; strides: bytes.
        self._owner, self._address, self._device = owner, address, device
        self.shape, self._strides, self._type = shape, strides, type

    @property
    def __cuda_array_interface__(self) -> dict:
        return {
            "shape": self.shape,
            "strides": self._strides,
            "typestr": self._type,
            "data": (self._address, False),
            "version": 3,
        }

    def __dlpack__(self, **arguments: Any) -> Any:
        size = int(self._type[2:])
        return _native.device_array(
            self._address,
            list(self.shape),
            [stride // size for stride in self._strides],
            self._type[1],
            8 * size,
            self._device,
            self._owner,
        )

    def __dlpack_device__(self) -> Tuple[int, int]:
        return (2, self._device)  # 2: kDLCUDA


class DeviceContacts:
    """The contacts of `Detector.detect_async`. The first dimension of each array is the room for contacts:
    the first ``status[2]`` rows are contacts, sorted as those of `Detector.detect`.

    Attributes:
        status: int32, shape (4,): hash (two words), number of contacts, and bits: 0 if these are all contacts;
            1 a position is not finite, 2 one is beyond 2^100, 4 a list was too short, 8 a query needs the host.
        kind: int32, shape (n,): `VERTEX_FACE` or `EDGE_EDGE`.
        bodies, primitives: int32, shape (n, 2).
        vertices: int32, shape (n, 4).
        uv: float32, shape (n, 2).
        normal: float32, shape (n, 3).
        toi: float64, shape (n,).
    """

    def __init__(self, owner: Any, contacts: int, status: int, capacity: int, device: int) -> None:
        def field(name: str, columns: int, type: str) -> DeviceArray:
            size = int(type[2:])
            shape = (capacity,) if columns == 1 else (capacity, columns)
            strides = (contact_dtype.itemsize,) if columns == 1 else (contact_dtype.itemsize, size)
            address = contacts + contact_dtype.fields[name][1] if contacts != 0 else 0
            return DeviceArray(owner, address, shape, strides, type, device)

        self.status = DeviceArray(owner, status, (4,), (4,), "<i4", device)
        self.kind = field("kind", 1, "<i4")
        self.bodies = field("body_a", 2, "<i4")
        self.primitives = field("primitive_a", 2, "<i4")
        self.vertices = field("vertices", 4, "<i4")
        self.uv = field("u", 2, "<f4")
        self.normal = field("normal", 3, "<f4")
        self.toi = field("toi", 1, "<f8")
