"""Figures of how the run went in time: speeds, events, latency, lateness."""

from collections.abc import Sequence

import numpy as np

from rig.records import Json
from rig.report.marks import curve, layout, numbers, thin
from rig.report.shown import Shown
from rig.report.timing import dropped_at_s, image_latency_s, tick_lateness_s

Figure = dict[str, Json]

_MAY_SHOW = 5000  # marks of one kind; more slow the browser down


def residual_figure(runs: Sequence[Shown]) -> Figure:
    """What each image contradicted the prediction by."""
    data: list[Json] = []
    for run in runs:
        track = run.record.data.update_track()
        data.append(curve(run, run.analysis.t_s, track.residual))
    out = layout("residual of each image", "‖s − ŝ‖")
    out["yaxis"] = {"title": {"text": "‖s − ŝ‖"}, "type": "log", "gridcolor": "#e6e9ee"}
    return {"data": data, "layout": out}


def speed_figure(runs: Sequence[Shown]) -> Figure:
    """The tool's speed commanded, allowed and measured, and where less was allowed."""
    data: list[Json] = []
    for run in runs:
        commands = run.record.commands
        if not commands:
            continue
        t_s = np.array([command.t_s for command in commands]) - run.record.start_s
        for name, dash in (("commanded", "dot"), ("allowed", "dash"), ("measured", "solid")):
            twists = np.array([getattr(command, name) for command in commands])
            speed_mm_s = 1e3 * np.linalg.norm(twists[:, :3], axis=1)
            line = curve(run, t_s, speed_mm_s, unit="mm/s", name=_of(runs, run, name))
            data.append({**line, "line": {"color": run.colour, "dash": dash, "width": 1.3}})
        data += _cuts(run, runs)
    title = "speed of the tool: commanded, allowed (× cut by the limiter), measured"
    return {"data": data, "layout": layout(title, "‖v‖ [mm/s]", from_zero=True)}


def event_figure(runs: Sequence[Shown]) -> Figure:
    """Every event at its time; hover tells its detail."""
    data: list[Json] = []
    for run in runs:
        events = run.record.events
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": run.name,
                "x": [round(event.t_s - run.record.start_s, 6) for event in events],
                "y": [event.name for event in events],
                "text": [event.detail or "–" for event in events],
                "marker": {"color": run.colour, "size": 9, "symbol": "line-ns-open"},
                "hovertemplate": "%{x:.3f} s: %{y}<br>%{text}",
            }
        )
    out = layout("events", "")
    out["yaxis"] = {"automargin": True, "type": "category", "autorange": "reversed"}
    return {"data": data, "layout": out}


def latency_figure(runs: Sequence[Shown]) -> Figure:
    """The age of each image when the loop took it, and the gaps in the camera's sequence."""
    data: list[Json] = []
    for run in runs:
        handled_s, latency_s = image_latency_s(run.record)
        keep = thin(len(handled_s))
        start_s = run.record.start_s
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": _of(runs, run, "latency"),
                "x": numbers(handled_s[keep] - start_s),
                "y": numbers(1e3 * latency_s[keep]),
                "marker": {"color": run.colour, "size": 4},
                "hovertemplate": "%{x:.3f} s: %{y:.1f} ms",
            }
        )
        drops = dropped_at_s(run.record)[:_MAY_SHOW]
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": _of(runs, run, "dropped before"),
                "x": [round(t_s - start_s, 6) for t_s, _ in drops],
                "y": [0.0 for _ in drops],
                "text": [str(count) for _, count in drops],
                "marker": {"color": run.colour, "size": 8, "symbol": "x-thin-open"},
                "hovertemplate": "%{x:.3f} s: %{text} images missing",
            }
        )
    title = "images: exposure to control loop (× missing in the sequence)"
    return {"data": data, "layout": layout(title, "latency [ms]", from_zero=True)}


def lateness_figure(runs: Sequence[Shown]) -> Figure:
    """A histogram of how late the control ticks began."""
    lateness_ms = [1e3 * tick_lateness_s(run.record) for run in runs]
    greatest = max((float(late.max()) for late in lateness_ms if len(late)), default=0.0)
    edges = np.linspace(0.0, max(greatest, 0.1), 61)
    data: list[Json] = []
    for run, late_ms in zip(runs, lateness_ms, strict=True):
        counts, _ = np.histogram(late_ms, edges)
        data.append(
            {
                "type": "bar",
                "name": run.name,
                "x": numbers(0.5 * (edges[:-1] + edges[1:])),
                "y": [int(count) for count in counts],
                "width": float(edges[1]),
                "marker": {"color": run.colour},
                "opacity": 0.7 if len(runs) > 1 else 1.0,
                "hovertemplate": "%{x:.3f} ms: %{y} ticks",
            }
        )
    out = layout("lateness of control ticks", "ticks", "late [ms]")
    out["yaxis"] = {"title": {"text": "ticks"}, "type": "log", "gridcolor": "#e6e9ee"}
    out["barmode"] = "overlay"
    return {"data": data, "layout": out}


def _cuts(run: Shown, runs: Sequence[Shown]) -> list[Json]:
    cut = [command for command in run.record.commands if command.reasons][:_MAY_SHOW]
    if not cut:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": _of(runs, run, "cut"),
            "x": [round(command.t_s - run.record.start_s, 6) for command in cut],
            "y": numbers(1e3 * np.array([np.linalg.norm(c.allowed[:3]) for c in cut])),
            "text": [", ".join(command.reasons) for command in cut],
            "marker": {"color": run.colour, "size": 7, "symbol": "x-thin-open"},
            "hovertemplate": "%{x:.3f} s: limited by %{text}",
        }
    ]


def _of(runs: Sequence[Shown], run: Shown, what: str) -> str:
    return what if len(runs) == 1 else f"{run.name}: {what}"
