"""LazyCCD in PyBullet: cloth and soft bodies no longer pass through.

    import pybullet as p, lazyccd.pybullet
    p.connect(p.DIRECT)
    lazyccd.pybullet.load()
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)

After `load`, or any other of these functions, every soft and deformable world of the server has LazyCCD's contacts, in DIRECT and GUI mode. All
functions take `physicsClientId` as PyBullet's do. PyBullet itself needs no change.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from importlib import metadata
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Union

import numpy as np
import pybullet as _p

SUPPORTED = {"pybullet": "3.2.7", "pybullet-arm64": "3.2.8"}
"""Packages that are PyBullet, and the version whose memory layout the plugin library knows. The second is a fork for
all machines, with the C++ sources of the first's 3.2.7."""

contact_dtype = np.dtype(
    [
        ("kind", np.int32),
        ("body_a", np.int32),
        ("link_a", np.int32),
        ("body_b", np.int32),
        ("link_b", np.int32),
        ("nodes", np.int32, 4),
        ("unused", np.int32),
        ("weights", np.float64, 4),
        ("point", np.float64, 3),
        ("normal", np.float64, 3),
        ("toi", np.float64),
        ("impulse", np.float64),
        ("friction_impulse", np.float64, 3),
    ]
)
"""One contact; at least one of its bodies is soft.

- ``kind``: `lazyccd.VERTEX_FACE` or `lazyccd.EDGE_EDGE`.
- ``body_a``, ``link_a``, ``body_b``, ``link_b``: unique ids and link indices of PyBullet; link -1: the base.
- ``nodes``: the vertex of body a and the face's three of body b; or the edges' two each. Numbers as in
  ``getMeshData(..., flags=MESH_DATA_SIMULATION_MESH)``; -1: a vertex of a rigid body.
- ``weights``: weights of the four in the gap, sum zero.
- ``point``: on body b, at the end of the step, metres, world frame.
- ``normal``: unit vector from b to a.
- ``toi``: 0 to 1 of the step: when the pair first touched or came near.
- ``impulse``: N s, along the normal, from b on a; never negative. Divided by the duration of a step of the
  engine (``fixedTimeStep / max(numSubSteps, 1)``) it is the force.
- ``friction_impulse``: N s, perpendicular to the normal, from b on a.
"""

_LIBRARY = Path(__file__).with_name("liblazyccd_pybullet.so")
_LONGEST_COMMAND = 1000  # PyBullet's commands have 1024 characters
_SERVER_IN_THIS_PROCESS = ("DIRECT", "GUI", "GUI_SERVER", "SHARED_MEMORY_SERVER", "GRAPHICS_SERVER")
_library = None
_reply_lock = threading.Lock()  # the reply of a command is fetched by a call of its own


def load(physicsClientId: int = 0) -> None:
    """Loads LazyCCD into the server of this client. Loading it again does nothing.

    Raises:
        RuntimeError: not connected, another version of PyBullet, a server in another process, or the package
            was built without the plugin library.
    """
    _plugin(physicsClientId)
    state = status(physicsClientId)
    if state.startswith("refused"):
        raise RuntimeError(state)


def on(physicsClientId: int = 0) -> None:
    """Switches LazyCCD on again, in this world and in later ones."""
    _execute("on", physicsClientId)


def off(physicsClientId: int = 0) -> None:
    """Gives this world Bullet's own handling back, and later worlds theirs. PyBullet's unloadPlugin must not be
    used: any plugin that is loaded after it crashes PyBullet."""
    _execute("off", physicsClientId)


def options(physicsClientId: int = 0, **values: Union[float, bool, str]) -> Dict[str, Any]:
    """Sets options of the solvers, all or none, and returns all of them.

    The names are those of `SolverOptions` in C++ (lazyccd/bullet/options.h): ``thickness``, ``friction``,
    ``restitution``, ``untangling_speed`` and so on; also ``threads`` and ``backend``.

    Raises:
        ValueError: there is no such option, or the value is not of its type or out of its range.
    """
    if not values:
        return _table(_execute("options", physicsClientId))
    words = ["set"]
    for name, value in values.items():
        text = repr(float(value)) if isinstance(value, (int, float, np.number, np.bool_)) else str(value)
        if not text or len(text.split()) != 1:
            raise ValueError(f"{name}: {value!r} is not a value of an option")
        words += [name, text]
    command = " ".join(words)
    if len(command) > _LONGEST_COMMAND:
        raise ValueError(f"options: more than {_LONGEST_COMMAND} characters at once")
    return _table(_execute(command, physicsClientId))


def status(physicsClientId: int = 0) -> str:
    """What LazyCCD does in this world, the backend in use, and a line for all that was left out or failed."""
    return _execute("status", physicsClientId).decode()


class ExcludedBody(NamedTuple):
    """A soft body that collision detection leaves out because it is lost. It pushes nothing."""

    body: int
    """Unique id of PyBullet."""
    node: int
    """A node that shows the reason, as in ``getMeshData``; -1: the whole body does."""
    reason: str
    """``not_finite``, ``overflow``, ``inverted`` or ``unresolved_step``: ExclusionReason in lazyccd/bullet/report.h."""


_REASONS = ("not_finite", "overflow", "inverted", "unresolved_step")


def excluded_bodies(physicsClientId: int = 0) -> List[ExcludedBody]:
    """The bodies that the last step left out. They take part again when they are right again."""
    records = np.frombuffer(_execute("excluded", physicsClientId), np.int32).reshape(-1, 3).tolist()
    return [ExcludedBody(body, node, _REASONS[reason]) for body, node, reason in records]


def stats(total: bool = False, physicsClientId: int = 0) -> Dict[str, Any]:
    """Counts, milliseconds and joules of the last step, or of all steps since the world was attached.

    The names are those of `StepStats` in C++ (lazyccd/bullet/report.h). With sub-steps the last step is the last
    sub-step.
    """
    return _table(_execute("total_stats" if total else "stats", physicsClientId))


def contacts(physicsClientId: int = 0) -> np.ndarray:
    """Contacts of the last step with at least one soft body, an array of `contact_dtype`.

    Empty after a body was removed, until the next step.
    """
    return np.frombuffer(_execute("contacts", physicsClientId), contact_dtype)


def _table(reply: bytes) -> Dict[str, Any]:
    table: Dict[str, Any] = {}
    for name, value in (line.split(" ", 1) for line in reply.decode().splitlines()):
        if value in ("True", "False"):
            table[name] = value == "True"
            continue
        for kind in (int, float, str):
            try:
                table[name] = kind(value)
                break
            except ValueError:
                continue
    return table


@functools.lru_cache(maxsize=None)
def _installed() -> Dict[str, str]:
    versions = {}
    for name in SUPPORTED:
        try:
            versions[name] = metadata.version(name)  # reads files, and every command asks for it
        except metadata.PackageNotFoundError:
            pass
    return versions


def _require_supported() -> None:
    installed = _installed().items()
    if not installed or not installed <= SUPPORTED.items():
        found = " and ".join(f"{name} {version}" for name, version in installed) or "an unknown pybullet"
        raise RuntimeError(
            f"{found} is installed; LazyCCD needs another: pip install pybullet=={SUPPORTED['pybullet']}"
        )


def _load_library() -> Any:
    global _library
    if _library is None:
        if not _LIBRARY.exists():
            raise RuntimeError("this package was built without the plugin library (LAZYCCD_PYBULLET=OFF)")
        _library = ctypes.CDLL(str(_LIBRARY))
        _library.lazyccd_pybullet_reply.restype = ctypes.c_longlong
        _library.lazyccd_pybullet_reply.argtypes = [ctypes.c_int, ctypes.POINTER(ctypes.c_void_p)]
    return _library


def _server_methods() -> List[int]:
    return [getattr(_p, name) for name in _SERVER_IN_THIS_PROCESS if hasattr(_p, name)]


def _plugin(client: int) -> int:
    """Returns the plugin's number in the server of `client`, after loading it where it is not loaded."""
    _require_supported()
    connection = _p.getConnectionInfo(physicsClientId=client)
    if not connection["isConnected"]:
        raise RuntimeError(f"client {client} is not connected to a physics server")
    if connection["connectionMethod"] not in _server_methods():
        raise RuntimeError("LazyCCD needs a server in this process: p.connect(p.DIRECT) or p.connect(p.GUI)")
    _load_library()
    number = _p.loadPlugin(str(_LIBRARY), "_lazyccd", physicsClientId=client)
    if number < 0:
        raise RuntimeError("PyBullet could not load the plugin library")
    return number


def _execute(command: str, client: int) -> bytes:
    """Sends a command to the plugin and returns the bytes of its reply."""
    plugin = _plugin(client)
    with _reply_lock:
        number = _p.executePluginCommand(plugin, command, physicsClientId=client)
        data = ctypes.c_void_p()
        named = -number - 1 if number < 0 else number
        size = _load_library().lazyccd_pybullet_reply(named, ctypes.byref(data))
        if size < 0:
            raise RuntimeError("the plugin did not answer")
        reply = ctypes.string_at(data, size) if size > 0 else b""
    if number < 0:
        raise ValueError(reply.decode())
    return reply
