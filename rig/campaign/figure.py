"""A campaign in one figure: who is fastest, by how much, how exact, and whether intervals hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray
from scipy.stats import binom

from rig.campaign.table import Line, lines_of
from rig.campaign.worker import Row

FloatArray = NDArray[np.float64]

# Of estimators, or of motions where there is but one estimator.
_COLOURS = {
    "observer": "#1f5fa8",
    "kalman": "#c62828",
    "batch": "#2e7d32",
    "triangulation": "#8a6d00",
    "limb_plane": "#6a3d9a",
    "limb_plane_ekf": "#e0771b",
    "information": "#c62828",
    "circle": "#1f5fa8",
    "paper": "#2e7d32",
    "constant": "#8a6d00",
    "servo": "#6a3d9a",
}
_WIDTH_INCH, _ROW_INCH, _REST_INCH, _DPI = 11.5, 0.27, 1.5, 90
_GAP_ROWS = 1.9  # between blocks, for their titles
_TITLE_ROWS = 0.95  # above a block's first row
_SPREAD_ROWS = 0.5  # of a row's dots


@dataclass(frozen=True, slots=True)
class _Place:
    """A line of the table at its height in the figure."""

    y: float
    line: Line
    colour: str
    times_s: FloatArray  # of the runs that stayed within 1 %
    faster: float | None  # than the slowest of its block


def draw_campaign(path: Path, target: str, rows: Sequence[Row]) -> None:
    """Draw a block per start and condition, the fastest on top, into ``path`` (PNG)."""
    blocks = _blocks(rows)
    places = [place for block in blocks.values() for place in block]
    figure, panels = plt.subplots(
        1,
        3,
        figsize=(_WIDTH_INCH, _ROW_INCH * (places[-1].y + 1.0) + _REST_INCH),
        sharey=True,
        layout="constrained",
        gridspec_kw={"width_ratios": (2.0, 1.0, 1.0), "wspace": 0.06},
    )
    runs = max(place.line.runs for place in places)
    figure.suptitle(f"{target}: {runs} simulated runs of each, the fastest on top")
    draws = (_draw_times, _draw_errors, _draw_intervals)
    for axes, draw in zip(panels, draws, strict=True):
        draw(axes, places)
        axes.grid(axis="x", color="0.9", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.tick_params(axis="y", length=0)
        axes.spines[["top", "right", "left"]].set_visible(False)
    _name_rows(panels[0], blocks)
    figure.savefig(path, dpi=_DPI)
    plt.close(figure)


def _blocks(rows: Sequence[Row]) -> dict[str, list[_Place]]:
    """The lines of each start and condition, the fastest first, with their heights."""
    lines = lines_of(rows)
    one_estimator = len({line.estimator for line in lines}) == 1
    out: dict[str, list[_Place]] = {}
    y = 0.0
    for start, noise in dict.fromkeys((line.start, line.noise) for line in lines):
        block = [line for line in lines if (line.start, line.noise) == (start, noise)]
        times_s = {id(line): _times_s(rows, line) for line in block}
        block.sort(key=lambda line: _slowness(line, times_s[id(line)]))
        medians = [line.time_to_1pct_s for line in block if line.time_to_1pct_s]
        places = []
        for line in block:
            colour = _COLOURS[line.policy if one_estimator else line.estimator]
            faster = max(medians) / line.time_to_1pct_s if line.time_to_1pct_s else None
            places.append(_Place(y, line, colour, times_s[id(line)], faster))
            y += 1.0
        out[f"start: {start}, condition: {noise}"] = places
        y += _GAP_ROWS
    return out


def _slowness(line: Line, times_s: FloatArray) -> tuple[float, float, float]:
    """What lines are ordered by: the median, those that never stayed within, the mean."""
    median_s = np.inf if line.time_to_1pct_s is None else line.time_to_1pct_s
    mean_s = float(times_s.mean()) if times_s.size else np.inf
    return median_s, line.runs - times_s.size, mean_s


def _times_s(rows: Sequence[Row], line: Line) -> FloatArray:
    group = (line.start, line.noise, line.policy, line.estimator)
    return np.array(
        [
            row["time_to_1pct_s"]
            for row in rows
            if (row["start"], row["noise"], row["policy"], row["estimator"]) == group
            and row["time_to_1pct_s"] is not None
        ],
        dtype=float,
    )


def _name_rows(axes: Axes, blocks: dict[str, list[_Place]]) -> None:
    places = [place for block in blocks.values() for place in block]
    names = [f"{place.line.estimator}, {place.line.policy}" for place in places]
    axes.set_yticks([place.y for place in places], names)
    for label, place in zip(axes.get_yticklabels(), places, strict=True):
        label.set_color(place.colour)
    axes.set_ylim(places[-1].y + 0.8, -1.5)
    for title, block in blocks.items():
        axes.text(
            *(0.0, block[0].y - _TITLE_ROWS, title),
            transform=axes.get_yaxis_transform(),
            fontweight="bold",
            va="center",
        )


def _draw_times(axes: Axes, places: Sequence[_Place]) -> None:
    """Every run a dot, the median a bar, and in words what it comes to."""
    _log_scale(axes, 2.0, 5.0)
    times_s = np.concatenate([place.times_s for place in places])
    # Where the first image was enough: left of all others.
    least_s = 0.5 * float(times_s[times_s > 0.0].min(initial=1.0))
    for place in places:
        dots_s = np.maximum(place.times_s, least_s)
        spread = np.linspace(-0.5, 0.5, len(dots_s)) * _SPREAD_ROWS
        axes.plot(dots_s, place.y + spread, ".", color=place.colour, alpha=0.35, markersize=4)
        if place.line.time_to_1pct_s is not None:
            _bar(axes, max(place.line.time_to_1pct_s, least_s), place.y, place.colour, 3.0)
        axes.text(
            *(1.01, place.y, _verdict(place)),
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=9,
        )
    axes.set_xlabel(
        "time until R stays within ± 1 % [s]\n· a run   | their median   × faster than the slowest"
    )


def _verdict(place: _Place) -> str:
    """The median, how much faster that is than the slowest, and the runs that never got there."""
    line, never = place.line, place.line.runs - len(place.times_s)
    words = [] if line.time_to_1pct_s is None else [f"{line.time_to_1pct_s:.2f} s"]
    if place.faster is not None and place.faster >= 1.05:
        words.append(f"×{place.faster:.{0 if place.faster >= 9.5 else 1}f}")
    if never:
        words.append("never" if never == line.runs else f"{never} never")
    if line.failed:
        words.append(f"({line.failed} failed)")
    return "  ".join(words)


def _draw_errors(axes: Axes, places: Sequence[_Place]) -> None:
    """The rms error at the end, and the bound that no estimator can pass."""
    _log_scale(axes)
    for place in places:
        rms, efficiency = place.line.rms_error, place.line.efficiency
        if rms:
            axes.plot(100.0 * rms, place.y, "o", color=place.colour)
        if rms and efficiency:
            _bar(axes, 100.0 * rms / efficiency, place.y, "black", 1.5)
    axes.set_xlabel("rms error at the end [%]\n● reached   | Cramér-Rao bound")


def _draw_intervals(axes: Axes, places: Sequence[_Place]) -> None:
    """How often the truth was inside, beside what chance makes of 95 %."""
    for place in places:
        line, found = place.line, place.line.runs - place.line.failed
        if line.covered is None:
            axes.text(0.5, place.y, "no interval", color="0.5", va="center", ha="center")
            continue
        low, high = (float(binom.ppf(p, found, 0.95)) / found for p in (0.025, 0.975))
        axes.barh(place.y, high - low, left=low, height=0.8, color="#cfe8cf")
        honest = low <= line.covered <= high
        axes.plot(line.covered, place.y, "o" if honest else "X", color=place.colour)
    axes.set_xlim(-0.03, 1.05)
    axes.set_xticks([0.0, 0.5, 0.95], ["0", "50", "95"])
    axes.set_xlabel("truth in the 95 % interval [%]\ngreen: as it says   X: not")


def _bar(axes: Axes, x: float, y: float, colour: str, width: float) -> None:
    axes.plot([x, x], [y - 0.36, y + 0.36], color=colour, linewidth=width)


def _log_scale(axes: Axes, *marked: float) -> None:
    """Logarithmic, each decade marked at 1 and at ``marked``, in plain figures."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, *marked)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
