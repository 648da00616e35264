"""Writes a report: ``report.html`` and ``report.png``."""

from collections.abc import Sequence
from pathlib import Path

from rig.recorded.record import RunRecord
from rig.report.page import page
from rig.report.png import write_png
from rig.report.shown import shown

HTML_NAME = "report.html"
PNG_NAME = "report.png"


def write_reports(records: Sequence[RunRecord], out: Path) -> tuple[Path, Path]:
    """Write both into the directory ``out``; several runs lie over each other.

    Raises OSError when they cannot be written, ConfigError for images that cannot be read.
    """
    runs = shown(records)
    html, png = out / HTML_NAME, out / PNG_NAME
    html.write_text(page(runs), encoding="utf-8")
    write_png(png, runs)
    return html, png
