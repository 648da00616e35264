"""The paper's experiments: which runs make up each figure, and how each figure is drawn."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import matplotlib.pyplot as plt
from mpl_toolkits.mplot3d import Axes3D
from pydantic import BaseModel, ConfigDict

from rig.config import TargetKind
from rig.config_load import load_config, packaged_config, read_yaml
from rig.live import View
from rig.records import Json, make_run_dir, write_summary
from rig.report import panels
from rig.run import RunResult, execute

FIGURES = ("fig3", "fig4", "fig5")
Panel = Literal["transient", "deviation", "sigma2", "speed2", "path"]


class Curve(BaseModel):
    """One run of a figure: its name and colour, and what is laid over the default rig."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    colour: str
    target: TargetKind
    config: dict[str, Any]


class Experiment(BaseModel):
    """One figure of the paper."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    panels: tuple[Panel, ...]
    curves: tuple[Curve, ...]


def load_experiment(figure: str) -> Experiment:
    """The experiment behind ``figure``, one of FIGURES."""
    return Experiment.model_validate(read_yaml(packaged_config(f"experiments/{figure}.yaml")))


def run_curve(
    figure: str,
    curve: Curve,
    assignments: list[str],
    out: Path,
    view: View,
    stop_requested: Callable[[], bool],
) -> RunResult:
    """Run one curve into a run directory of its own below ``out``."""
    config = load_config(curve.target, None, assignments, curve.config)
    run_dir = make_run_dir(out / f"{figure}-{_file_name(curve.name)}", curve.target)
    result = execute(config, curve.target, run_dir, False, view, stop_requested)
    write_summary(run_dir, result.summary)
    return result


def describe(figure: str, curve: Curve, result: RunResult) -> dict[str, Json]:
    """What ``rig reproduce --json`` prints of one curve."""
    return {
        "figure": figure,
        "curve": curve.name,
        "rms_vs_ideal": result.analysis.rms_vs_ideal,
        "radius_m": result.summary["radius_m"],
        "relative_error": result.summary["relative_error"],
    }


def draw_figure(path: Path, experiment: Experiment, results: list[RunResult]) -> None:
    """Draw the figure's panels, all curves in each, into ``path`` (PNG)."""
    n = len(experiment.panels)
    figure = plt.figure(figsize=(6.5 * min(n, 2), 4.8 * ((n + 1) // 2)), layout="constrained")
    figure.suptitle(experiment.title)
    for index, panel in enumerate(experiment.panels):
        projection = "3d" if panel == "path" else None
        axes = figure.add_subplot((n + 1) // 2, min(n, 2), index + 1, projection=projection)
        for curve, result in zip(experiment.curves, results, strict=True):
            if isinstance(axes, Axes3D):
                panels.draw_path(axes, result.analysis, curve.name, curve.colour)
            else:
                _DRAW[panel](axes, result.analysis, curve.name, curve.colour)
    figure.savefig(path, dpi=90)
    plt.close(figure)


_DRAW = {
    "transient": panels.draw_transient,
    "deviation": panels.draw_deviation,
    "sigma2": panels.draw_sigma2,
    "speed2": panels.draw_speed2,
}


def _file_name(name: str) -> str:
    return name.replace(" ", "-").replace("*", "star")
