"""The rows of a sweep on disk: a folder of Parquet files, each complete or not there at all.

A point is a row at most once: a key that comes again is ignored, both when rows are added and when they are read.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Dict, Iterable, List, Tuple, Union

import pyarrow as pa
import pyarrow.parquet as pq

Row = Dict[str, Any]
KEY = "point"
"""Column with the point as JSON; the row's key."""


def key_of(point: Row) -> str:
    return json.dumps(point, sort_keys=True)


def _parts(folder: Path) -> List[Path]:
    return sorted(folder.glob("part-*.parquet"))


def _table(parts: Iterable[Path]) -> pa.Table:
    tables = [pq.read_table(part) for part in parts]
    if not tables:
        return pa.table({KEY: pa.array([], pa.string())})
    table = pa.concat_tables(tables, promote_options="permissive")
    seen: Dict[str, int] = {}
    for i, key in enumerate(table[KEY].to_pylist()):
        seen.setdefault(key, i)
    return table if len(seen) == len(table) else table.take(list(seen.values()))


def read(folder: Union[str, "os.PathLike[str]"]) -> pa.Table:
    """Returns all rows of a sweep, sorted by their points. The order does not depend on the run."""
    table = _table(_parts(Path(folder)))
    return table.sort_by(KEY)


class Store:
    """Adds rows to a folder. They are on disk after `flush`, which happens by itself every `rows_per_part` rows."""

    def __init__(self, folder: Union[str, "os.PathLike[str]"], rows_per_part: int = 256):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        for unfinished in self.folder.glob("*.unfinished"):
            unfinished.unlink()
        self.rows_per_part = rows_per_part
        self.known = set(_table(_parts(self.folder))[KEY].to_pylist())
        self._pending: List[Row] = []

    def add(self, point: Row, figures: Row) -> bool:
        """Adds a row; returns false if the point has one already."""
        key = key_of(point)
        if key in self.known:
            return False
        self.known.add(key)
        self._pending.append({KEY: key, **point, **figures})
        if len(self._pending) >= self.rows_per_part:
            self.flush()
        return True

    def flush(self) -> None:
        if self._pending:
            self._write(pa.Table.from_pylist(self._pending, _schema(self._pending)))
            self._pending = []

    def compact(self) -> None:
        """Joins all parts into one. A crash in the middle leaves rows that `read` sees once."""
        self.flush()
        parts = _parts(self.folder)
        if len(parts) > 1:
            self._write(_table(parts))
            for part in parts:
                part.unlink()

    def _write(self, table: pa.Table) -> None:
        parts = _parts(self.folder)
        number = 1 + (int(parts[-1].stem.split("-")[1]) if parts else 0)
        path = self.folder / f"part-{number:06d}.parquet"
        unfinished = path.with_suffix(".unfinished")
        with open(unfinished, "wb") as file:
            pq.write_table(table, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)


def _schema(rows: List[Row]) -> pa.Schema:
    """All columns of the rows; from_pylist alone takes those of the first row."""
    columns: Dict[str, List[Any]] = {}
    for row in rows:
        for name in row:
            columns.setdefault(name, [])
    fields: List[Tuple[str, pa.DataType]] = []
    for name in columns:
        fields.append((name, pa.array([row.get(name) for row in rows]).type))
    return pa.schema(fields)
