"""The run directory: the resolved configuration, the log (see ``rig.log``), the summary."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from drivers.clock import local_timestamp
from drivers.errors import ConfigError
from rig.config import RigConfig, TargetKind
from rig.config_load import dump_config
from rig.log.header import CONFIG_NAME
from rig.log.run_log import LOG_NAME

Json = float | int | str | bool | None | Sequence["Json"] | Mapping[str, "Json"]

SUMMARY_NAME = "summary.json"


def make_run_dir(out: Path | None, target: TargetKind) -> Path:
    """Create the run's directory: ``out``, or a new dated one below ``runs/``.

    Raises ConfigError when it cannot be written or already holds a run.
    """
    path = _free_name(Path("runs") / f"{local_timestamp()}-{target}") if out is None else out
    try:
        path.mkdir(parents=True, exist_ok=out is not None)
        if (path / SUMMARY_NAME).exists() or (path / LOG_NAME).exists():
            raise ConfigError(f"{path} already holds a run: choose another --out")
        # Only tried: a run whose devices cannot be opened leaves nothing that blocks the next.
        (path / LOG_NAME).touch()
        (path / LOG_NAME).unlink()
    except OSError as error:
        raise ConfigError(f"cannot write the run directory {path}: {error}") from error
    return path


def make_figures_dir(out: Path | None, name: str) -> Path:
    """Create the directory of a set of figures: ``out``, or a new dated one below ``runs/``."""
    path = _free_name(Path("runs") / f"{local_timestamp()}-{name}") if out is None else out
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the directory {path}: {error}") from error
    return path


def _free_name(path: Path) -> Path:
    candidate, n = path, 2
    while candidate.exists():
        candidate, n = path.with_name(f"{path.name}-{n}"), n + 1
    return candidate


def write_config(run_dir: Path, config: RigConfig) -> None:
    """Write ``config.yaml``, which ``--rig`` reads back; raises ConfigError where it cannot be."""
    path = run_dir / CONFIG_NAME
    try:
        path.write_text(dump_config(config), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error}") from error


def write_summary(run_dir: Path, summary: Mapping[str, Json]) -> None:
    """Write ``summary.json`` as a whole or not at all; one that is there is replaced."""
    text = json.dumps(dict(summary), indent=2, allow_nan=False)
    path = run_dir / SUMMARY_NAME
    partial = path.with_name(f"{path.name}.partial")
    partial.write_text(text + "\n", encoding="utf-8")
    partial.replace(path)
