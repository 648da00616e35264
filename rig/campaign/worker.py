"""One run of a comparison, in a process of its own: from a job to a row of figures."""

import tempfile
from pathlib import Path

import numpy as np
import yaml

from drivers.errors import RigError
from rig.analysis import Analysis
from rig.campaign.job import Job
from rig.campaign.sources import sources_here
from rig.config_load import configured
from rig.live import QuietView
from rig.run import RunResult, execute

# Where the course of the error is kept, in s from the first image.
GRID_S = np.arange(0.0, 6.0 + 1e-9, 0.05)
# Poses so many samples apart: between neighbours the encoders' steps would add to the path.
_PATH_STRIDE = 25

Value = float | int | str | bool | list[float] | None
Row = dict[str, Value]


class OtherSourcesError(Exception):
    """Whoever asks has another version of the program than whoever works."""


def run_case(job: Job) -> Row:
    """Run a job's case; a run that fails is a row as well, with its error.

    Raises OtherSourcesError where this program is not the one that asks.
    """
    if job.sources != sources_here():
        raise OtherSourcesError(f"{sources_here()} at work, {job.sources} asking")
    case = job.case
    row: Row = {
        "target": case.target,
        "start": case.start,
        "noise": case.noise,
        "policy": case.policy,
        "estimator": case.estimator,
        "seed": case.seed,
    }
    settings = [*case.assignments, "log.images=off", *job.assignments]
    try:
        config = configured(yaml.safe_load(job.rig), settings, "the configuration")
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
