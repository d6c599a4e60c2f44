"""Runs the points of a sweep on the workers of a Ray cluster.

Rows come from this process alone, one for each point: a point counts as done when its row is here. A worker that dies
takes no row along, and its point runs again.
"""

from __future__ import annotations

import sys
import time
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence

from .store import Row, Store, key_of

ATTEMPTS = 3
SECONDS_BETWEEN_FLUSHES = 5.0


def points_of(task: ModuleType, axes: Mapping[str, Sequence[Any]], settings: Mapping[str, Any]) -> List[Row]:
    """The points of the sweep. `axes` replaces values of the task's own axes.

    Raises:
        ValueError: the task has no axis of that name.
    """
    for name in axes:
        if name not in task.AXES:
            raise ValueError(f"there is no axis {name!r}; there are {', '.join(task.AXES)}")
    merged = {**task.AXES, **axes}
    if hasattr(task, "points"):
        return list(task.points(merged, **settings))
    return [dict(zip(merged, values)) for values in product(*merged.values())]


def sweep(
    task: ModuleType,
    axes: Mapping[str, Sequence[Any]],
    folder: str,
    *,
    workers: Optional[int] = None,
    address: Optional[str] = None,
    settings: Mapping[str, Any] = {},
    attempts: int = ATTEMPTS,
    progress: Optional[Callable[[int, int], None]] = None,
) -> int:
    """Measures all points that have no row in `folder` yet, and returns how many it measured.

    Args:
        task: the module that measures, see `lazyccd.sweep`. If Ray's workers cannot import it by name, it is sent.
        workers: points that run at the same time; all CPUs of the cluster by default.
        address: address of a Ray cluster; a cluster of this machine's own by default.
        attempts: a point whose worker died so often gets a row with the outcome "worker died".
        progress: called with the number of rows and that of all points.

    An exception of `run` gives a row too; its column ``outcome`` starts with "error".
    """
    import ray

    todo_points = points_of(task, axes, settings)
    store = Store(folder)
    todo = [point for point in todo_points if key_of(point) not in store.known]
    todo.reverse()  # points are taken from the end
    done = len(todo_points) - len(todo)
    tell = progress or (lambda rows, of: None)
    tell(done, len(todo_points))
    if not todo:
        store.compact()
        return 0

    own_cluster = not ray.is_initialized()
    if own_cluster and address is None:
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)
    elif own_cluster:
        ray.init(address=address, log_to_driver=False)
    try:
        cpus = max(1, int(ray.cluster_resources().get("CPU", 1)))
        # One point waits for each that runs, unless the cluster would run it at once.
        submitted = workers if workers and workers < cpus else 2 * (workers or cpus)
        measured = _run(
            ray, task, dict(settings), todo, store, submitted, attempts, lambda n: tell(done + n, len(todo_points))
        )
        store.compact()
    finally:
        store.flush()
        if own_cluster:
            ray.shutdown()
    return measured


def _run(
    ray: Any,
    task: ModuleType,
    settings: Dict[str, Any],
    todo: List[Row],
    store: Store,
    submitted: int,
    attempts: int,
    tell: Callable[[int], None],
) -> int:
    for module in _sent_modules(task):
        ray.cloudpickle.register_pickle_by_value(module)
    measure = ray.remote(max_retries=0, num_cpus=1)(_measure(task))
    running: Dict[Any, Row] = {}
    tries: Dict[str, int] = {}
    measured, flushed = 0, time.monotonic()
    while todo or running:
        while todo and len(running) < submitted:
            point = todo.pop()
            running[measure.remote(point, settings)] = point
        ready, _ = ray.wait(list(running), num_returns=1, timeout=SECONDS_BETWEEN_FLUSHES)
        for reference in ready:
            point = running.pop(reference)
            try:
                figures = ray.get(reference)
            except ray.exceptions.RayTaskError:  # the task could not be loaded there
                raise
            except ray.exceptions.RayError as failure:  # the worker or its machine died
                key = key_of(point)
                tries[key] = tries.get(key, 0) + 1
                if tries[key] < attempts:
                    todo.append(point)
                    continue
                figures = {"outcome": "worker died"}
                print(f"\n{key}: {failure}", file=sys.stderr)
            measured += store.add(point, figures)
            tell(measured)
        if time.monotonic() - flushed > SECONDS_BETWEEN_FLUSHES:
            store.flush()
            flushed = time.monotonic()
    return measured


def _sent_modules(task: ModuleType) -> List[ModuleType]:
    """The task and its neighbours in one folder, if they are not of this package. Workers need not find the files."""
    if task.__name__.startswith("lazyccd."):
        return []
    if not getattr(task, "__file__", None):
        return [task]
    folder = Path(task.__file__ or "").parent
    return [
        module
        for module in list(sys.modules.values())
        if isinstance(getattr(module, "__file__", None), str)
        and Path(module.__file__ or "").parent == folder
        and module.__name__ != "__main__"
    ]


def _measure(task: ModuleType) -> Callable[[Row, Dict[str, Any]], Row]:
    run = task.run

    def measure(point: Row, settings: Dict[str, Any]) -> Row:
        try:
            return dict(run(dict(point), **settings))
        except Exception as failure:  # a row, so that the sweep goes on
            return {"outcome": f"error: {type(failure).__name__}: {failure}"}

    return measure


def rows_without(table: Any, columns: Iterable[str]) -> List[Row]:
    """The rows of a table without some columns, to compare two runs."""
    return table.drop_columns([name for name in columns if name in table.column_names]).to_pylist()
