"""A campaign in one table: a line per estimator, motion and condition."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.table import Table
from scipy.stats import chi2

from rig.campaign.worker import Row
from rig.records import Json

FloatArray = NDArray[np.float64]
Group = tuple[str, str, str, str]  # start, noise, policy, estimator


@dataclass(frozen=True, slots=True)
class Line:
    """What the runs of one group come to; None where a figure is not known of any."""

    start: str
    noise: str
    policy: str
    estimator: str
    runs: int
    failed: int  # without a radius
    time_to_1pct_s: float | None  # median; None: half of the runs or more never stayed within
    time_to_1pct_90_s: float | None
    rms_error: float | None  # of R at the end, relative
    nees: float | None  # mean
    consistent: bool | None  # whether that mean is where 95 % of such means lie
    covered: float | None  # share of runs whose 95 % interval holds the truth
    efficiency: float | None  # rms error over the Cramér-Rao bound
    path_m: float | None  # median
    frames_lost: float | None  # mean share
    doubted: int


def lines_of(rows: Sequence[Row]) -> list[Line]:
    """One line per group, in the order of names."""
    groups: dict[Group, list[Row]] = {}
    for row in rows:
        start, noise, policy, estimator = (
            str(row[name]) for name in ("start", "noise", "policy", "estimator")
        )
        key = (start, noise, policy, estimator)
        groups.setdefault(key, []).append(row)
    return [_line(key, groups[key]) for key in sorted(groups)]


def records_of(lines: Sequence[Line]) -> list[Json]:
    """The lines as JSON has them."""
    return [{name: getattr(line, name) for name in Line.__slots__} for line in lines]


def table_of(target: str, lines: Sequence[Line]) -> Table:
    """The lines for a reader."""
    out = Table(
        *("start", "condition", "motion", "estimator", "runs", "to 1 % [s]", "90 %"),
        *("rms error [%]", "NEES", "covered", "rms / bound", "path [m]", "lost", "doubted"),
        title=target,
    )
    for column in out.columns[:4]:
        column.no_wrap = True
    for line in lines:
        nees = _text(line.nees, "{:.2f}") + ("" if line.consistent in (True, None) else " !")
        out.add_row(
            *(line.start, line.noise, line.policy, line.estimator),
            str(line.runs) + (f" ({line.failed} failed)" if line.failed else ""),
            *(_text(line.time_to_1pct_s, "{:.2f}"), _text(line.time_to_1pct_90_s, "{:.2f}")),
            _text(line.rms_error, "{:.4f}", 100.0),
            nees,
            _text(line.covered, "{:.0f} %", 100.0),
            _text(line.efficiency, "{:.2f}"),
            _text(line.path_m, "{:.3f}"),
            _text(line.frames_lost, "{:.1f} %", 100.0),
            str(line.doubted),
        )
    return out


def _line(key: Group, rows: list[Row]) -> Line:
    found = [row for row in rows if row["relative_error"] is not None]
    errors, nees = _column(found, "relative_error"), _column(found, "nees")
    bounds = _column(found, "relative_bound")
    rms = None if errors.size == 0 else float(np.sqrt(np.mean(errors**2)))
    bound = float(np.sqrt(np.mean(bounds**2))) if bounds.size else None
    frames = _column(found, "frames").sum()
    consistent = None
    if nees.size:
        low, high = (chi2.ppf(p, nees.size) / nees.size for p in (0.025, 0.975))
        consistent = bool(low <= nees.mean() <= high)
    return Line(
        *key,
        runs=len(rows),
        failed=len(rows) - len(found),
        time_to_1pct_s=_quantile(found, len(rows), 0.5),
        time_to_1pct_90_s=_quantile(found, len(rows), 0.9),
        rms_error=rms,
        nees=float(nees.mean()) if nees.size else None,
        consistent=consistent,
        covered=float(np.mean(nees <= chi2.ppf(0.95, 1))) if nees.size else None,
        efficiency=rms / bound if rms is not None and bound else None,
        path_m=float(np.median(_column(found, "path_m"))) if found else None,
        frames_lost=float(_column(found, "frames_lost").sum() / frames) if frames else None,
        doubted=sum(bool(row["doubted"]) for row in rows),
    )


def _column(rows: list[Row], name: str) -> FloatArray:
    return np.array([row[name] for row in rows if row[name] is not None], dtype=float)


def _quantile(rows: list[Row], runs: int, share: float) -> float | None:
    """Of the times to stay within 1 %, those that never did counting as the longest."""
    times = np.sort(_column(rows, "time_to_1pct_s"))
    index = max(int(np.ceil(share * runs)) - 1, 0)
    return float(times[index]) if index < times.size else None


def _text(value: float | None, pattern: str, factor: float = 1.0) -> str:
    return "–" if value is None else pattern.format(value * factor)
