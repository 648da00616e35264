"""The runs below a directory, newest first; broken and unfinished ones among them."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from rich.table import Table

from drivers.errors import ConfigError
from rig.recorded.setup import SETUP_NAME, RunSetup, read_setup
from rig.recorded.summary import read_summary
from rig.records import SUMMARY_NAME, Json
from rig.report.texts import date_text, figure, number

# Any of them makes a directory a run's; they come into being in this order.
_MARKS = ("config.yaml", SETUP_NAME, SUMMARY_NAME)
_DEEPEST = 3  # `rig reproduce` keeps its runs in a directory of its own


@dataclass(frozen=True, slots=True)
class PastRun:
    """One line of the list; None where it is not known."""

    directory: Path
    started_at: str  # YYYYmmdd-HHMMSS, of its files where it is not recorded
    target: str | None
    radius_m: float | None
    radius_std_m: float | None
    relative_error: float | None
    ending: str  # "cut off" for a run without a summary, else how it ended

    def as_json(self) -> dict[str, Json]:
        """What ``rig runs --json`` prints of it."""
        return {
            "run_dir": str(self.directory),
            "started_at": self.started_at,
            "target": self.target,
            "radius_m": self.radius_m,
            "radius_std_m": self.radius_std_m,
            "relative_error": self.relative_error,
            "ending": self.ending,
        }


def past_runs(folder: Path) -> list[PastRun]:
    """Every run below ``folder``, newest first; raises ConfigError where it is no directory."""
    if not folder.is_dir():
        raise ConfigError(f"{folder} is no directory: name the one that holds the runs")
    found = [_past_run(path) for path in _run_dirs(folder, _DEEPEST)]
    return sorted(found, key=lambda run: (run.started_at, str(run.directory)), reverse=True)


def table(runs: list[PastRun]) -> Table:
    """The list as people read it."""
    out = Table(box=None, pad_edge=False)
    for name in ("date", "target", "radius", "error", "ending", "run directory"):
        right, path = name in ("radius", "error"), name == "run directory"
        out.add_column(
            name, justify="right" if right else "left", overflow="fold", no_wrap=not path
        )
    for run in runs:
        error = figure(run.relative_error, "{:+.3f} %", 100)
        if run.relative_error is None:
            error = figure(run.radius_std_m, "± {:.4f} mm", 1e3)
        out.add_row(
            date_text(run.started_at),
            run.target or "–",
            figure(run.radius_m, "{:.4f} mm", 1e3),
            error,
            run.ending,
            str(run.directory),
        )
    return out


def _run_dirs(folder: Path, deepest: int) -> list[Path]:
    if any((folder / name).exists() for name in _MARKS):
        return [folder]
    if deepest == 0:
        return []
    try:
        below = [path for path in folder.iterdir() if path.is_dir() and not path.is_symlink()]
    except OSError:
        return []  # what may not be read is not listed
    return [run_dir for path in below for run_dir in _run_dirs(path, deepest - 1)]


def _past_run(run_dir: Path) -> PastRun:
    setup: RunSetup | None = None
    try:
        setup = read_setup(run_dir)
        ending = "cut off"
    except ConfigError:
        ending = "never began"
    summary = read_summary(run_dir)
    values = summary or {}
    target = values.get("target") or (setup and setup.target)
    return PastRun(
        directory=run_dir,
        started_at=_changed_at(run_dir) if setup is None else setup.started_at,
        target=None if target is None else str(target),
        radius_m=number(values, "radius_m"),
        radius_std_m=number(values, "radius_std_m"),
        relative_error=number(values, "relative_error"),
        ending=ending if summary is None else str(values.get("ending", "unknown")),
    )


def _changed_at(run_dir: Path) -> str:
    return f"{datetime.fromtimestamp(run_dir.stat().st_mtime):%Y%m%d-%H%M%S}"
