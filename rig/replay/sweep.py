"""One setting, several values, the same recording: a table and a plot."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import matplotlib.pyplot as plt
import yaml
from rich.table import Table

from drivers.errors import ConfigError
from rig.replay.engine import Replay, replay
from rig.replay.recording import Recording
from rig.replay.settings import Source


@dataclass(frozen=True, slots=True)
class Point:
    """One value and what came of it."""

    value: str
    replay: Replay


def parse_sweep(text: str) -> tuple[str, list[str]]:
    """The key and the values of ``a.b=1,2,3``; raises ConfigError for anything else."""
    key, equals, listed = text.partition("=")
    try:
        values: Any = yaml.safe_load(f"[{listed}]")
    except yaml.YAMLError as error:
        raise ConfigError(f"--sweep {text!r}: the values cannot be read: {error}") from error
    if not equals or not key.strip() or not isinstance(values, list) or not values:
        raise ConfigError(f"--sweep {text!r}: write it as a.b=1,2,3")
    return key.strip(), [one if isinstance(one, str) else json.dumps(one) for one in values]


def sweep(
    recording: Recording, key: str, values: list[str], assignments: list[str], source: Source
) -> list[Point]:
    """Replay once for each value; raises ConfigError before the first for a wrong one."""
    settings = [[*assignments, f"{key}={value}"] for value in values]
    for one in settings:
        recording.config(one)
    return [
        Point(value, replay(recording, one, source))
        for value, one in zip(values, settings, strict=True)
    ]


def sweep_table(key: str, points: list[Point]) -> Table:
    """The values side by side."""
    out = Table(key, "radius [mm]", "error [%]", "rms from (5) [%]", "within 1 % after [s]")
    for point in points:
        found = point.replay.summary
        out.add_row(
            point.value,
            _number(found["radius_m"], 1e3, ".4f"),
            _number(found["relative_error"], 1e2, "+.3f"),
            _number(found["rms_vs_ideal"], 1e2, ".3f"),
            _number(found["time_to_1pct_s"], 1.0, ".2f"),
        )
    return out


def draw_sweep(path: Path, key: str, points: list[Point]) -> None:
    """The radius over time for each value, into ``path`` (PNG); raises ConfigError."""
    figure, axes = plt.subplots(figsize=(9, 5.5), layout="constrained")
    for point in points:
        analysis = point.replay.analysis
        good = (analysis.chi > 0.0) & (analysis.radius_m < _most_shown_m(points))
        axes.plot(analysis.t_s[good], 1e3 * analysis.radius_m[good], label=f"{point.value}")
    true_m = points[0].replay.analysis.radius_true_m
    if true_m is not None:
        axes.axhline(1e3 * true_m, color="black", linestyle=":", label="true")
    axes.set(
        title=f"the same recording, {key}", xlabel="since the first image [s]", ylabel="R [mm]"
    )
    axes.grid(alpha=0.3)
    axes.legend(title=key)
    try:
        figure.savefig(path, dpi=100)
    except OSError as error:
        raise ConfigError(f"cannot write the plot {path}: {error}") from error
    finally:
        plt.close(figure)


def _most_shown_m(points: list[Point]) -> float:
    """Transients that pass through infinity must not flatten everything else."""
    ends = [
        float(point.replay.analysis.radius_m[-1])
        for point in points
        if len(point.replay.analysis.radius_m) and point.replay.analysis.chi[-1] > 0.0
    ]
    guesses = [point.replay.config.estimator.radius_guess_m for point in points]
    return 3.0 * max([*ends, *guesses])


def _number(value: Any, factor: float, pattern: str) -> str:
    return format(value * factor, pattern) if isinstance(value, int | float) else "–"
