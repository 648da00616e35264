"""The camera's path in space, with arrows along its optical axis, and the target (figs. 3b, 5d)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.records import Json
from rig.report.marks import numbers, thin
from rig.report.shown import Shown

FloatArray = NDArray[np.float64]
Figure = dict[str, Json]

_ARROWS = 9
_AXIS_SHOWN_M = 0.12  # half the length drawn of a cylinder
_AROUND, _ALONG = 24, 13  # facets of the target


def path_figure(runs: Sequence[Shown]) -> Figure:
    """All paths in the base frame, to turn and to hover over."""
    data: list[Json] = []
    for run in runs:
        if len(run.analysis.path_m):
            data += [_path(run), *_optical_axes(run), *_target(run)]
    axes: dict[str, Json] = {
        f"{name}axis": {"title": {"text": f"{name} [m]"}, "backgroundcolor": "#f7f8fa"}
        for name in "xyz"
    }
    return {
        "data": data,
        "layout": {
            "title": {
                "text": "camera path with optical axes, base frame",
                "font": {"size": 14},
                "x": 0.02,
                "xanchor": "left",
            },
            "font": {"family": "system-ui, sans-serif", "size": 11, "color": "#1f2933"},
            "margin": {"l": 0, "r": 0, "t": 44, "b": 0},
            "scene": {
                **axes,
                "aspectmode": "data",
                "camera": {"eye": {"x": 1.9, "y": 1.9, "z": 1.1}},
            },
            "legend": {"orientation": "h", "y": 0.0},
            "paper_bgcolor": "white",
        },
    }


def _path(run: Shown) -> Json:
    analysis = run.analysis
    keep = thin(len(analysis.path_m))
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": run.name,
        **_xyz(analysis.path_m[keep]),
        "text": [f"{t_s:.2f} s" for t_s in analysis.motion_t_s[keep]],
        "line": {"color": run.colour, "width": 5},
        "hovertemplate": "%{text}<br>(%{x:.4f}, %{y:.4f}, %{z:.4f}) m",
    }


def _optical_axes(run: Shown) -> list[Json]:
    p, z = run.analysis.path_m, run.analysis.optical_axes
    some = np.linspace(0, len(p) - 1, _ARROWS).astype(int)
    length_m = 0.3 * float(np.ptp(p, axis=0).max()) + 1e-3
    tips = p[some] + length_m * z[some]
    gap = np.full((len(some), 3), np.nan)
    shafts = np.stack([p[some], tips, gap], axis=1).reshape(-1, 3)
    return [
        {
            "type": "scatter3d",
            "mode": "lines",
            "name": "optical axis",
            "showlegend": False,
            **_xyz(shafts),
            "line": {"color": run.colour, "width": 2},
            "hoverinfo": "skip",
        },
        {
            "type": "cone",
            **_xyz(tips),
            **dict(zip("uvw", (numbers(column) for column in z[some].T), strict=True)),
            "anchor": "tip",
            "sizemode": "raw",
            "sizeref": 0.2 * length_m,
            "showscale": False,
            "colorscale": [[0, run.colour], [1, run.colour]],
            "hoverinfo": "skip",
        },
    ]


def _target(run: Shown) -> list[Json]:
    """The target where, and as large as, the estimate at the end has it."""
    analysis = run.analysis
    if analysis.target_m is None:
        return []
    radius_m = float(analysis.radius_m[-1])
    if not radius_m > 0.0:
        return []
    surface = (
        _sphere(analysis.target_m, radius_m)
        if analysis.target_axis is None
        else _cylinder(analysis.target_m, analysis.target_axis, radius_m)
    )
    return [
        {
            "type": "surface",
            "name": "target as estimated",
            **{name: [numbers(row) for row in surface[..., i]] for i, name in enumerate("xyz")},
            "showscale": False,
            "opacity": 0.55,
            "colorscale": [[0, run.colour], [1, run.colour]],
            "hovertemplate": f"{run.name}: R̂ = {1e3 * radius_m:.4f} mm<extra></extra>",
        }
    ]


def _sphere(centre_m: FloatArray, radius_m: float) -> FloatArray:
    polar = np.linspace(0.0, np.pi, _ALONG)[:, None]
    around = np.linspace(0.0, 2 * np.pi, _AROUND)[None, :]
    x, y = np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)
    unit = np.stack([x, y, np.cos(polar) + 0.0 * around], axis=-1)
    points: FloatArray = centre_m + radius_m * unit
    return points


def _cylinder(point_m: FloatArray, axis: FloatArray, radius_m: float) -> FloatArray:
    across = np.linalg.svd(axis[None, :])[2][1:]  # two unit vectors normal to the axis
    around = np.linspace(0.0, 2 * np.pi, _AROUND)
    ring = radius_m * (np.outer(np.cos(around), across[0]) + np.outer(np.sin(around), across[1]))
    along = np.outer([-_AXIS_SHOWN_M, _AXIS_SHOWN_M], axis)
    points: FloatArray = point_m + along[:, None, :] + ring[None, :, :]
    return points


def _xyz(points: FloatArray) -> dict[str, Json]:
    return {name: numbers(points[:, i]) for i, name in enumerate("xyz")}
