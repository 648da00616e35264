"""What the report's figures share: curves, layouts, and numbers short enough to embed."""

import numpy as np
from numpy.typing import NDArray

from rig.records import Json
from rig.report.shown import Shown

FloatArray = NDArray[np.float64]

IDEAL = "#222222"
_POINTS = 1500  # more than a screen has columns
_DIGITS = 7
_FONT: dict[str, Json] = {"family": "system-ui, sans-serif", "size": 12, "color": "#1f2933"}


def curve(
    run: Shown, t_s: FloatArray, values: FloatArray, unit: str = "", name: str = ""
) -> dict[str, Json]:
    """A line over time in the run's colour, thinned to what a screen can show."""
    keep = thin(len(t_s))
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name or run.name,
        "x": numbers(t_s[keep]),
        "y": numbers(values[keep]),
        "line": {"color": run.colour, "width": 1.6},
        "hovertemplate": f"%{{x:.3f}} s: %{{y:.6g}} {unit}",
    }


def layout(title: str, y: str, x: str = "t [s]", from_zero: bool = False) -> dict[str, Json]:
    """A plain layout; times count from the first image used."""
    y_axis: dict[str, Json] = {"title": {"text": y}, "zeroline": False, "gridcolor": "#e6e9ee"}
    if from_zero:
        y_axis["rangemode"] = "tozero"
    return {
        "title": {"text": title, "font": {"size": 14}, "x": 0.02, "xanchor": "left"},
        "font": _FONT,
        "margin": {"l": 64, "r": 16, "t": 40, "b": 76},
        "xaxis": {"title": {"text": x}, "zeroline": False, "gridcolor": "#e6e9ee"},
        "yaxis": y_axis,
        "legend": {
            "orientation": "h",
            "yref": "container",
            "y": 0.01,
            "yanchor": "bottom",
            "x": 0.5,
            "xanchor": "center",
        },
        "hovermode": "closest",
        "plot_bgcolor": "white",
        "paper_bgcolor": "white",
    }


def thin(count: int) -> slice:
    """Every so many of ``count`` points."""
    return slice(None, None, max(1, -(-count // _POINTS)))


def numbers(values: FloatArray) -> list[Json]:
    """Values with as many digits as a plot needs; what is not finite becomes a gap."""
    return [
        float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
        for value in np.asarray(values, dtype=float).ravel()
    ]
