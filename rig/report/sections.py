"""The parts of the page that are text, tables and images."""

from collections.abc import Sequence

from rig.config_load import dump_config
from rig.report.headline import error_bar
from rig.report.shown import Shown
from rig.report.stills import stills
from rig.report.texts import date_text, escape, figure, json_text, number

_NO_IMAGES = "<p>none was recorded</p>"
_CUT_OFF = "the run was cut off: there is no summary"


def cards(runs: Sequence[Shown]) -> str:
    """A headline per run: the radius, its error bar and what that means."""
    return "".join(_card(run) for run in runs)


def images(runs: Sequence[Shown]) -> str:
    """The selected images of every run."""
    parts = []
    for run in runs:
        heading = f"<p>{escape(run.name)}</p>" if len(runs) > 1 else ""
        chosen = stills(run.record)
        shots = "".join(
            f'<figure><img alt="image at {still.t_s:.2f} s" src="{still.source}">'
            f"<figcaption>t = {still.t_s:.2f} s</figcaption></figure>"
            for still in chosen
        )
        body = (
            f'<section class="stills">{shots}</section>' if chosen else "<p>none was recorded</p>"
        )
        parts.append(heading + body)
    return "".join(parts)


def summary_table(runs: Sequence[Shown]) -> str:
    """Every figure of every summary, exactly as its file has it."""
    summaries = [run.record.summary or {} for run in runs]
    keys = dict.fromkeys(key for summary in summaries for key in summary)
    head = "".join(f"<th>{escape(run.name)}</th>" for run in runs)
    rows = []
    for key in keys:
        cells = "".join(
            f'<td data-run="{index}" data-key="{escape(key)}">'
            f"{escape(json_text(summary[key])) if key in summary else '–'}</td>"
            for index, summary in enumerate(summaries)
        )
        rows.append(f"<tr><th>{escape(key)}</th>{cells}</tr>")
    return f"<table><tr><th></th>{head}</tr>{''.join(rows)}</table>"


def details(runs: Sequence[Shown]) -> str:
    """Per run: the calibration used, the configuration, and the list of events."""
    return "".join(_calibration(run) + _config(run) + _events(run) for run in runs)


def _card(run: Shown) -> str:
    setup, summary = run.record.setup, run.record.summary
    values = summary or {}
    radius_m, bar = number(values, "radius_m"), error_bar(run.record)
    shown = "no radius"
    if radius_m is not None:
        spread = figure(bar.plus_minus_m, " ± {:.4f}", 1e3) if bar else ""
        shown = f"{1e3 * radius_m:.4f}<small>{spread} mm</small>"
    facts = [
        ("true radius", figure(setup.radius_true_m, "{:.4f} mm", 1e3)),
        ("relative error", figure(number(values, "relative_error"), "{:+.3f} %", 100)),
        ("within ± 1 % after", figure(number(values, "time_to_1pct_s"), "{:.2f} s")),
        ("rms from ideal", figure(number(values, "rms_vs_ideal"), "{:.3f} % of z(0)", 100)),
        (
            "images",
            f"{values.get('frames', '–')}, {values.get('frames_lost', '–')} without outline",
        ),
        ("ending", str(values.get("ending", _CUT_OFF))),
        ("target", setup.target),
        ("started", date_text(setup.started_at)),
    ]
    rows = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in facts)
    error = values.get("error")
    trouble = f'<p class="bad">{escape(str(error))}</p>' if error else ""
    return (
        f'<div class="card" style="border-left-color:{run.colour}">'
        f'<div class="name">{escape(run.name)}</div><div class="radius">{shown}</div>'
        f'<div class="meaning">{escape(f"±: {bar.meaning}") if bar else ""}</div>'
        f"{trouble}<dl>{rows}</dl></div>"
    )


def _calibration(run: Shown) -> str:
    setup, config = run.record.setup, run.record.config
    lens = setup.intrinsics
    rows = [
        ("from", setup.calibration),
        ("focal lengths", f"{lens.fx_px:.6g}, {lens.fy_px:.6g} px"),
        ("principal point", f"{lens.cx_px:.6g}, {lens.cy_px:.6g} px"),
        ("distortion (k1, k2, p1, p2, k3)", ", ".join(f"{k:.6g}" for k in lens.distortion)),
        ("stamps late by", f"{1e3 * config.calibration.latency_s:.3g} ms"),
        ("T_tool_camera", "; ".join(" ".join(f"{x:.6f}" for x in r) for r in setup.T_tool_camera)),
    ]
    body = "".join(f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in rows)
    return _folded(f"Calibration · {run.name}", f"<table>{body}</table>", opened=True)


def _config(run: Shown) -> str:
    text = dump_config(run.record.config)
    return _folded(f"Configuration · {run.name}", f"<pre>{escape(text)}</pre>")


def _events(run: Shown) -> str:
    start_s = run.record.start_s
    rows = "".join(
        f"<tr><td>{event.t_s - start_s:.3f} s</td><td>{escape(event.name)}</td>"
        f"<td>{escape(event.detail)}</td></tr>"
        for event in run.record.events
    )
    return _folded(f"Events · {run.name}", f"<table>{rows}</table>")


def _folded(heading: str, body: str, opened: bool = False) -> str:
    state = " open" if opened else ""
    return f"<details{state}><summary>{escape(heading)}</summary>{body}</details>"
