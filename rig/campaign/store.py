"""What a campaign has finished: one parquet file that a later call goes on from."""

import json
import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from drivers.errors import ConfigError
from rig.campaign.cases import Case
from rig.campaign.worker import Row

RESULTS_NAME = "results.parquet"
_SETTINGS_NAME = "campaign.json"
_KEY = ("target", "start", "noise", "policy", "estimator", "seed")


class Store:
    """The rows of one campaign; a row is there once, however often the campaign was begun.

    Raises ConfigError where the directory holds another campaign, or pyarrow is missing.
    """

    def __init__(self, directory: Path, settings: dict[str, object]) -> None:
        self._pa, self._parquet = _pyarrow()
        self._path = directory / RESULTS_NAME
        try:
            directory.mkdir(parents=True, exist_ok=True)
            _check_settings(directory / _SETTINGS_NAME, settings)
            self.rows: list[Row] = self._read() if self._path.exists() else []
        except OSError as error:
            raise ConfigError(f"cannot use the directory {directory}: {error}") from error
        self._done = {_key_of_row(row) for row in self.rows}

    def missing(self, cases: Sequence[Case]) -> list[Case]:
        """Those that have no row yet."""
        return [case for case in cases if _key_of(case) not in self._done]

    def rows_of(self, cases: Sequence[Case]) -> list[Row]:
        """What there is of ``cases``; the store may hold those of other calls as well."""
        wanted = {_key_of(case) for case in cases}
        return [row for row in self.rows if _key_of_row(row) in wanted]

    def add(self, row: Row) -> None:
        """Keep a row in memory, unless there is one of that run."""
        key = _key_of_row(row)
        if key not in self._done:
            self._done.add(key)
            self.rows.append(row)

    def write(self) -> None:
        """Replace the file in one step: a kill leaves the old one or the new one."""
        if not self.rows:
            return
        part = self._path.with_suffix(".part")
        self._parquet.write_table(self._pa.Table.from_pylist(self.rows, self._schema()), part)
        os.replace(part, self._path)

    def _read(self) -> list[Row]:
        try:
            rows: list[Row] = self._parquet.read_table(self._path).to_pylist()
        except (OSError, ValueError) as error:  # pyarrow's own errors are among these
            raise ConfigError(f"{self._path} cannot be read: {error}; remove it") from error
        return rows

    def _schema(self) -> Any:
        pa = self._pa
        text, number, whole = pa.string(), pa.float64(), pa.int64()
        return pa.schema(
            [
                *((name, text) for name in _KEY[:-1]),
                ("seed", whole),
                *(
                    (name, number)
                    for name in (
                        *("time_to_1pct_s", "relative_error", "relative_std", "nees"),
                        *("relative_bound", "path_m"),
                    )
                ),
                ("frames", whole),
                ("frames_lost", whole),
                ("doubted", pa.bool_()),
                ("course", pa.list_(number)),
                ("error", text),
            ]
        )


def _key_of(case: Case) -> tuple[object, ...]:
    """What tells a case's row from all others."""
    return tuple(getattr(case, name) for name in _KEY)


def _key_of_row(row: Row) -> tuple[object, ...]:
    return tuple(row[name] for name in _KEY)


def _check_settings(path: Path, settings: dict[str, object]) -> None:
    """Rows of different settings must not end up in one table."""
    text = json.dumps(settings, indent=2, sort_keys=True)
    if not path.exists():
        path.write_text(text + "\n", encoding="utf-8")
    elif path.read_text(encoding="utf-8").strip() != text:
        raise ConfigError(
            f"{path} is of a campaign with other settings, or of another version of the program: "
            "choose another --out"
        )


def _pyarrow() -> tuple[Any, Any]:
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError as error:
        raise ConfigError(
            "a comparison needs the package pyarrow: pip install 'activerig[parquet]'"
        ) from error
