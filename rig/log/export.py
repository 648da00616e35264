"""A log as tables: one file a kind of record, or one of JSON lines."""

import csv
import json
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, Protocol

from drivers.errors import ConfigError
from rig.log.columns import columns, is_number, row
from rig.log.lines import lines
from rig.log.reader import Log
from rig.log.topics import BY_KIND, RECORDS, Topic

Format = Literal["csv", "jsonl", "parquet"]
_BATCH = 20_000  # rows held in memory


class Table(Protocol):
    """One file being written."""

    def add(self, cells: dict[str, Any]) -> None:
        """Append a row."""
        ...

    def close(self) -> None:
        """Write what is left and close."""
        ...


def export(log: Log, out: Path, fmt: Format) -> dict[str, int]:
    """Write a log's records into the directory ``out``; rows by file name.

    Raises ConfigError when it cannot be written, or when the package for parquet is missing.
    """
    open_table = _parquet if fmt == "parquet" else _CsvTable
    if fmt == "parquet":
        _pyarrow()
    try:
        out.mkdir(parents=True, exist_ok=True)
        return _lines(log, out) if fmt == "jsonl" else _tables(log, out, fmt, open_table)
    except OSError as error:
        raise ConfigError(f"cannot write the export {out}: {error}") from error


def _lines(log: Log, out: Path) -> dict[str, int]:
    count = 0
    with (out / "log.jsonl").open("w", encoding="utf-8") as file:
        for line in lines(log):
            file.write(json.dumps(line) + "\n")
            count += 1
    return {"log.jsonl": count}


def _tables(
    log: Log, out: Path, fmt: str, open_table: Callable[[Path, Topic], Table]
) -> dict[str, int]:
    counts: dict[str, int] = {}
    tables: dict[str, Table] = {}
    with ExitStack() as stack:
        for record in log.records(RECORDS):
            kind = record.kind
            name = f"{kind}.{fmt}"
            if kind not in tables:
                tables[kind] = open_table(out / name, BY_KIND[kind])
                stack.callback(tables[kind].close)
            tables[kind].add(row(record.values(), record.logged_ns, record.t_ns))
            counts[name] = counts.get(name, 0) + 1
    return counts


class _CsvTable:
    """Comma-separated; an empty cell is a value that is unknown."""

    def __init__(self, path: Path, topic: Topic) -> None:
        self._file = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.DictWriter(self._file, columns(topic))
        self._writer.writeheader()

    def add(self, cells: dict[str, Any]) -> None:
        self._writer.writerow(cells)

    def close(self) -> None:
        self._file.close()


def _parquet(path: Path, topic: Topic) -> Table:
    return _ParquetTable(path, topic)


class _ParquetTable:
    """Columns with types; null where a value is unknown."""

    def __init__(self, path: Path, topic: Topic) -> None:
        pa = self._pa = _pyarrow()
        self._columns = columns(topic)
        fields = [(name, self._type(topic, name)) for name in self._columns]
        self._schema = pa.schema(fields)
        self._writer = import_module("pyarrow.parquet").ParquetWriter(path, self._schema)
        self._rows: list[dict[str, Any]] = []

    def add(self, cells: dict[str, Any]) -> None:
        self._rows.append(cells)
        if len(self._rows) >= _BATCH:
            self._flush()

    def close(self) -> None:
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        data = {name: [cells.get(name) for cells in self._rows] for name in self._columns}
        self._writer.write_table(self._pa.table(data, schema=self._schema))
        self._rows = []

    def _type(self, topic: Topic, column: str) -> Any:
        if is_number(topic, column):
            return self._pa.float64()
        schema = topic.schema["properties"].get(column, {})
        text = schema.get("type") in ("string", "array")
        return self._pa.string() if text else self._pa.int64()


def _pyarrow() -> Any:
    try:
        return import_module("pyarrow")
    except ImportError as error:
        raise ConfigError(
            "parquet needs the package pyarrow: pip install 'activerig[parquet]', or choose "
            "--format csv"
        ) from error
