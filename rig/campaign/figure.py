"""A campaign in one figure: how errors fall, and how long it takes to stay within 1 %."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from rig.campaign.worker import GRID_S, Row

_LINES = {"constant": "-", "paper": "--", "information": "-.", "circle": ":", "servo": (0, (1, 3))}
_COLOURS = {
    "observer": "#1f5fa8",
    "kalman": "#c62828",
    "batch": "#2e7d32",
    "triangulation": "#8a6d00",
    "limb_plane": "#6a3d9a",
    "limb_plane_ekf": "#e0771b",
}


def draw_campaign(path: Path, target: str, rows: Sequence[Row]) -> None:
    """Draw a column of panels per start and condition into ``path`` (PNG)."""
    names = list(dict.fromkeys((str(row["start"]), str(row["noise"])) for row in rows))
    figure, axes = plt.subplots(
        2,
        len(names),
        figsize=(max(7.0, 5.2 * len(names)), 8.4),
        squeeze=False,
        layout="constrained",
    )
    figure.suptitle(f"{target}: estimators and camera motions")
    for column, (start, noise) in enumerate(names):
        these = [
            row for row in rows if (row["start"], row["noise"]) == (start, noise) and row["course"]
        ]
        _courses(axes[0, column], noise if start == "default" else f"{start}, {noise}", these)
        _times(axes[1, column], these)
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def _courses(axes: Axes, title: str, rows: Sequence[Row]) -> None:
    """The median of |error| over time."""
    for name, group in _groups(rows).items():
        courses = [row["course"] for row in group]
        longest = max(len(course) for course in courses if isinstance(course, list))
        grid = np.full((len(courses), longest), np.nan)
        for k, course in enumerate(courses):
            assert isinstance(course, list)
            grid[k, : len(course)] = course
        median = 100.0 * np.nanmedian(grid, axis=0)
        policy, estimator = name
        axes.semilogy(
            GRID_S[:longest],
            median,
            _LINES[policy],
            color=_COLOURS[estimator],
            label=f"{estimator}, {policy}",
        )
    axes.axhline(1.0, color="grey", linewidth=0.7)
    axes.set(title=title, xlabel="t [s]", ylabel="median |error of R| [%]", ylim=(1e-3, 200))


def _times(axes: Axes, rows: Sequence[Row]) -> None:
    """Time to stay within 1 %, every run a dot."""
    groups = _groups(rows)
    for k, ((policy, estimator), group) in enumerate(groups.items()):
        times = [row["time_to_1pct_s"] for row in group if row["time_to_1pct_s"] is not None]
        spread = np.linspace(-0.25, 0.25, len(times)) if len(times) > 1 else np.zeros(len(times))
        axes.semilogy(k + spread, times, ".", color=_COLOURS[estimator], markersize=4)
        del policy
    axes.set_xticks(range(len(groups)), [f"{e}\n{p}" for p, e in groups], fontsize=7)
    axes.set(ylabel="time to stay within ± 1 % [s]")


def _groups(rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    out: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        out.setdefault((str(row["policy"]), str(row["estimator"])), []).append(row)
    return dict(sorted(out.items(), key=lambda item: (item[0][1], item[0][0])))
