"""The report's headline in one line."""

from collections.abc import Sequence

from rig.report.headline import error_bar
from rig.report.shown import Shown
from rig.report.texts import number


def title(runs: Sequence[Shown]) -> str:
    """What was measured, for one run; which runs, for several."""
    if len(runs) > 1:
        return " · ".join(f"{run.name}: {radius_text(run)}" for run in runs)
    run = runs[0]
    setup, summary = run.record.setup, run.record.summary or {}
    known = f" (true {setup.radius_true_m * 1e3:.3f} mm)" if setup.radius_true_m else ""
    return f"{setup.target}: {radius_text(run)}{known}, {summary.get('ending', 'cut off')}"


def radius_text(run: Shown) -> str:
    """R̂ with its error bar, both to the digits that the error bar warrants."""
    summary = run.record.summary or {}
    radius_m, bar = number(summary, "radius_m"), error_bar(run.record)
    if radius_m is None:
        return "no radius"
    if bar is None:
        return f"R̂ = {1e3 * radius_m:.3f} mm"
    return f"R̂ = {1e3 * radius_m:.4f} ± {1e3 * bar.plus_minus_m:.4f} mm"
