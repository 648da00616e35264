"""The report's figures as plotly.js takes them: plain data, so that drawing costs the run nothing.

plotly's own Python classes check and convert what these few figures have right already, and take
longer to import than the whole report to write.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rig.records import Json
from rig.report.geometry import path_figure
from rig.report.marks import IDEAL, curve, layout
from rig.report.shown import Shown
from rig.report.time_figures import (
    event_figure,
    latency_figure,
    lateness_figure,
    residual_figure,
    speed_figure,
)

FloatArray = NDArray[np.float64]
Figure = dict[str, Json]


def figures(runs: Sequence[Shown]) -> dict[str, Figure]:
    """Every figure by the name of its place on the page; several runs lie over each other.

    A figure that none of the runs has anything for is left out.
    """
    builders: dict[str, Callable[[Sequence[Shown]], Figure]] = {
        "radius": _radius,
        "path": path_figure,
        "transient": _transient,
        "deviation": _deviation,
        "sigma2": _sigma2,
        "speed2": _speed2,
        "residual": residual_figure,
        "speed": speed_figure,
        "events": event_figure,
        "latency": latency_figure,
        "lateness": lateness_figure,
    }
    built = {name: build(runs) for name, build in builders.items()}
    return {name: figure for name, figure in built.items() if figure["data"]}


def _radius(runs: Sequence[Shown]) -> Figure:
    data: list[Json] = []
    shapes: list[Json] = []
    finals = []
    for run in runs:
        analysis = run.analysis
        data += _stated_band(run)
        data.append(curve(run, analysis.t_s, 1e3 * analysis.radius_m, unit="mm"))
        if len(analysis.radius_m):
            finals.append(1e3 * float(analysis.radius_m[-1]))
        if analysis.radius_true_m is not None and len(analysis.t_s):
            true_mm = 1e3 * analysis.radius_true_m
            finals.append(true_mm)
            shapes += _true_radius(true_mm)
    finals = [value for value in finals if np.isfinite(value) and value > 0]
    out = layout("radius (dashed: true, band: ± 1 %)", "R̂ [mm]")
    if finals:
        out["yaxis"] = {**_axis(out), "range": [0.4 * min(finals), 2.2 * max(finals)]}
    # The same line once, however many runs have that radius.
    unique = {str(shape): shape for shape in shapes}
    return {"data": data, "layout": {**out, "shapes": list(unique.values())}}


def _stated_band(run: Shown) -> list[Json]:
    """R̂ with χ̂ taken two standard deviations up and down, where the estimator states them."""
    analysis = run.analysis
    if analysis.chi_std is None:
        return []
    out: list[Json] = []
    for sign, fill in ((1.0, None), (-1.0, "tonexty")):
        chi = analysis.chi + sign * 2.0 * analysis.chi_std
        with np.errstate(divide="ignore"):
            radius_m = np.where(chi > 0.0, 1.0 / chi, np.nan)
        line = curve(run, analysis.t_s, 1e3 * radius_m, unit="mm", name=f"{run.name}: ± 2 σ")
        edge: dict[str, Json] = {"color": run.colour, "width": 0}
        shade: dict[str, Json] = {"fill": fill, "fillcolor": f"{run.colour}33"} if fill else {}
        out.append({**line, "line": edge, "showlegend": False, **shade})
    return out


def _axis(out: dict[str, Json]) -> dict[str, Json]:
    axis = out["yaxis"]
    assert isinstance(axis, dict)
    return axis


def _true_radius(true_mm: float) -> list[Json]:
    across: dict[str, Json] = {"xref": "paper", "x0": 0, "x1": 1, "layer": "below"}
    return [
        {
            **across,
            "type": "rect",
            "y0": 0.99 * true_mm,
            "y1": 1.01 * true_mm,
            "fillcolor": "#2e8b57",
            "opacity": 0.18,
            "line": {"width": 0},
        },
        {
            **across,
            "type": "line",
            "y0": true_mm,
            "y1": true_mm,
            "line": {"color": IDEAL, "dash": "dash", "width": 1},
        },
    ]


def _transient(runs: Sequence[Shown]) -> Figure:
    """z(t) with the response (5) promises, as in figs. 3a, 4, 5c; χ̂ where truth is unknown.

    Beside another estimator than the paper's stands what the paper's would have said.
    """
    known = all(run.analysis.z is not None for run in runs)
    data: list[Json] = []
    for run in runs:
        analysis = run.analysis
        z = analysis.z if known and analysis.z is not None else analysis.chi
        data.append(curve(run, analysis.t_s, z, unit="1/m"))
        if known and analysis.z_observer is not None and analysis.other_than_observer:
            name = f"{run.name}: the paper's observer"
            observer = curve(run, analysis.t_s, analysis.z_observer, unit="1/m", name=name)
            grey: dict[str, Json] = {"color": run.colour, "dash": "dot", "width": 1.2}
            data.append({**observer, "line": grey})
        if known and analysis.z_ideal is not None:
            ideal = curve(run, analysis.t_s, analysis.z_ideal, unit="1/m")
            line: dict[str, Json] = {"color": IDEAL, "dash": "dash", "width": 1}
            data.append({**ideal, "line": line, "name": "ideal", "showlegend": False})
    if known:
        return {"data": data, "layout": layout("estimation error z (dashed: ideal)", "z [1/m]")}
    return {"data": data, "layout": layout("estimate χ̂ (true radius unknown)", "χ̂ [1/m]")}


def _deviation(runs: Sequence[Shown]) -> Figure:
    data: list[Json] = []
    for run in runs:
        share = run.analysis.deviation
        if share is not None:
            data.append(curve(run, run.analysis.t_s, 100.0 * share, unit="%"))
    return {"data": data, "layout": layout("deviation from the ideal response", "[% of z(0)]")}


def _sigma2(runs: Sequence[Shown]) -> Figure:
    return _motion(runs, lambda run: run.analysis.sigma2, "useful motion σ₁²", "σ₁² [m²/s²]")


def _speed2(runs: Sequence[Shown]) -> Figure:
    return _motion(runs, lambda run: run.analysis.speed2, "‖v‖² of the camera", "‖v‖² [m²/s²]")


def _motion(
    runs: Sequence[Shown], values: Callable[[Shown], FloatArray], title: str, name: str
) -> Figure:
    data: list[Json] = [curve(run, run.analysis.motion_t_s, values(run)) for run in runs]
    return {"data": data, "layout": layout(title, name, from_zero=True)}
