"""One run of a comparison, in a process of its own: from a case to a row of figures."""

import signal
import tempfile
from pathlib import Path

import numpy as np

from drivers.errors import RigError
from rig.analysis import Analysis
from rig.campaign.cases import Case
from rig.config_load import load_config
from rig.live import QuietView
from rig.run import RunResult, execute

# Where the course of the error is kept, in s from the first image.
GRID_S = np.arange(0.0, 6.0 + 1e-9, 0.05)
# Poses so many samples apart: between neighbours the encoders' steps would add to the path.
_PATH_STRIDE = 25

Value = float | int | str | bool | list[float] | None
Row = dict[str, Value]


def ignore_interrupts() -> None:
    """Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_case(case: Case, rig_file: Path | None, assignments: tuple[str, ...]) -> Row:
    """Run a case; a run that fails is a row as well, with its error."""
    row: Row = {
        "target": case.target,
        "noise": case.noise,
        "policy": case.policy,
        "estimator": case.estimator,
        "seed": case.seed,
    }
    settings = [*case.assignments, "log.images=off", *assignments]
    try:
        config = load_config(case.target, rig_file, settings)
        with tempfile.TemporaryDirectory(prefix="activerig-") as run_dir:
            result = execute(config, case.target, Path(run_dir), False, QuietView(), lambda: False)
    except RigError as error:
        return {**row, **_figures(None), "error": str(error)}
    return {**row, **_figures(result), "error": str(result.outcome.error or "")}


def _figures(result: RunResult | None) -> Row:
    """What is kept of a run; None where there is nothing to keep."""
    if result is None or result.summary["radius_m"] is None:
        names = ("time_to_1pct_s", "relative_error", "relative_std", "nees", "relative_bound")
        nothing: Row = dict.fromkeys((*names, "path_m", "frames", "frames_lost"), None)
        return {**nothing, "doubted": False, "course": []}
    analysis, summary = result.analysis, result.summary
    true_m = analysis.radius_true_m
    assert true_m is not None  # it is simulated
    std_m, bound_m = summary["radius_std_m"], summary["radius_bound_m"]
    return {
        "time_to_1pct_s": analysis.time_to_1pct_s,
        "relative_error": analysis.relative_error,
        "relative_std": std_m / true_m if isinstance(std_m, float) else None,
        "nees": analysis.nees,
        "relative_bound": bound_m / true_m if isinstance(bound_m, float) else None,
        "path_m": _path_m(analysis),
        "frames": result.outcome.data.frames,
        "frames_lost": result.outcome.data.frames_lost,
        "doubted": bool(result.outcome.data.doubts()),
        "course": _course(analysis, true_m),
    }


def _path_m(analysis: Analysis) -> float:
    points = analysis.path_m[::_PATH_STRIDE]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _course(analysis: Analysis, true_m: float) -> list[float]:
    """|relative error| at GRID_S, as far as the run went."""
    errors = np.abs(analysis.radius_m / true_m - 1.0)
    grid_s = GRID_S[analysis.t_s[-1] >= GRID_S]
    newest = np.searchsorted(analysis.t_s, grid_s, side="right") - 1
    return [float(error) for error in np.minimum(errors[newest], 10.0)]
