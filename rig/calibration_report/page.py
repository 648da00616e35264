"""``report.html``: one file with everything in it, and the same pictures beside it."""

import base64
import io
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from rig.calibration.latency_coarse import correlation_over_lag
from rig.calibration.latency_curves import residual_over_offset
from rig.calibration_report import figures
from rig.calibration_report.material import Material, pose_errors
from rig.calibration_report.tables import Row, details, values

_LATENCY_RANGE_S = 0.25
_OFFSETS_S = np.linspace(-0.02, 0.02, 41)
_CAPTIONS = {
    "coverage": "Corners should reach every part of the image, from near and far, straight and "
    "tilted.",
    "residuals": "Arrows all pointing one way in one part of the image mean a lens that the model "
    "does not fit; a few long ones, a wrongly found corner.",
    "poses": "Held-out poses were never used in the fit. Were they much worse than the fitted "
    "ones, the fit would have learnt its noise.",
    "wiggles": "The tool moved 5 mm along and turned 2° about each of its axes. Black arrows are "
    "what the calibration promised for the image, orange ones what it did.",
    "latency": "Both segments must peak, and have their least residual, at the same offset.",
}
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1100px; padding: 0 1em;
       color: #222; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
.verdict { padding: .7em 1em; border-radius: 6px; color: white; font-weight: 600; }
.passed { background: #2e7d32; } .failed { background: #b00020; }
table { border-collapse: collapse; } td { padding: .2em 1.2em .2em 0; vertical-align: top; }
td:first-child { color: #555; } td.number { font-variant-numeric: tabular-nums; }
img { max-width: 100%; } p.caption { color: #555; margin-top: 0; }
"""


def write_report(folder: Path, material: Material) -> Path:
    """Write ``report.html`` and its pictures into ``folder``; the page's path.

    The page needs neither the pictures beside it nor a network. Raises OSError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures: dict[str, bytes] = {}
    for name, draw in _figures(material).items():
        figure = draw()
        pictures[name] = _png(figure)
        plt.close(figure)
    for name in _CAPTIONS:  # none is left from a calibration before
        path = folder / f"{name}.png"
        if name in pictures:
            path.write_bytes(pictures[name])
        else:
            path.unlink(missing_ok=True)
    page = folder / "report.html"
    page.write_text(_html(material, pictures), encoding="utf-8")
    return page


def _figures(material: Material) -> dict[str, Callable[[], Figure]]:
    """What can be drawn of the steps that were done."""
    out: dict[str, Callable[[], Figure]] = {}
    geometry, verification = material.geometry, material.verification
    size = (640, 480)
    if material.stills:
        height, width = material.stills[0].image.shape
        size = (width, height)
    if geometry is not None and material.stills:
        errors = pose_errors(material.stills, geometry)
        out["coverage"] = lambda: figures.coverage(errors, geometry, size)
        out["residuals"] = lambda: figures.residuals(errors, geometry, size)
        out["poses"] = lambda: figures.poses(errors, geometry)
    if verification is not None:
        out["wiggles"] = lambda: figures.wiggles(verification.wiggles.results, size)
    if geometry is not None and material.latency is not None and material.recording is not None:
        out["latency"] = lambda: _latency(material)
    return out


def _latency(material: Material) -> Figure:
    assert material.geometry is not None
    assert material.latency is not None
    assert material.recording is not None
    state, recording, fit = material.geometry.state, material.recording, material.latency
    arm, offsets_s = recording.trajectory(), fit.latency_s + _OFFSETS_S
    curves = [
        (
            correlation_over_lag(segment, arm, state, _LATENCY_RANGE_S),
            residual_over_offset(segment, arm, state, offsets_s),
        )
        for segment in recording.segments
    ]
    return figures.latency(fit, [one[0] for one in curves], offsets_s, [one[1] for one in curves])


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=80)
    return out.getvalue()


def _html(material: Material, pictures: Mapping[str, bytes]) -> str:
    file = material.file
    verdict = file.verdict
    passed = verdict is not None and verdict.passed
    words = "passed: runs use it" if passed else "not usable"
    reasons = () if verdict is None else verdict.reasons
    parts = [
        f"<h1>Calibration of {escape(file.rig)}, {escape(file.made)}</h1>",
        f'<div class="verdict {"passed" if passed else "failed"}">{words}</div>',
        _list(reasons),
        "<h2>Values</h2>",
        _table(values(file)),
    ]
    for name, caption in _CAPTIONS.items():
        parts.append(f"<h2>{name.capitalize()}</h2>")
        if name in pictures:
            data = base64.b64encode(pictures[name]).decode("ascii")
            parts.append(f'<img alt="{name}" src="data:image/png;base64,{data}">')
            parts.append(f'<p class="caption">{escape(caption)}</p>')
        else:
            parts.append('<p class="caption">Not part of this step.</p>')
    parts += ["<h2>How it was obtained</h2>", _table(details(file))]
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        f"<title>Calibration of {escape(file.rig)}</title><style>{_STYLE}</style></head><body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _table(rows: list[Row]) -> str:
    cells = [
        f'<tr><td>{escape(name)}</td><td class="number">{escape(text)}</td></tr>'
        for name, text in rows
    ]
    return f"<table>{''.join(cells)}</table>"


def _list(items: tuple[str, ...]) -> str:
    return f"<ul>{''.join(f'<li>{escape(one)}</li>' for one in items)}</ul>" if items else ""
