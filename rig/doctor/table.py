"""The report for a person: a table, and a line on what it amounts to."""

from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from rig.doctor.finding import Finding, Status

_STYLE = {Status.OK: "green", Status.WARN: "yellow", Status.FAIL: "bold red"}


def table_of(findings: Sequence[Finding]) -> Table:
    """One row per check; what to do stands under what was found, whole lines to copy."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column("check", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("measured, and what to do", overflow="fold")
    for finding in findings:
        words = Text(finding.measured)
        if finding.advice:
            words.append(f"\n→ {finding.advice}", style="bold")
        status = Text(finding.status.value, style=_STYLE[finding.status])
        table.add_row(title_of(finding.name), status, words)
    return table


def title_of(name: str) -> str:
    """A check's name for a person."""
    return name.replace("_", " ")


def sum_up(findings: Sequence[Finding], interrupted: bool = False) -> str:
    """How many of each, in a sentence."""
    counts = {status: sum(f.status is status for f in findings) for status in Status}
    if interrupted:
        verdict = "interrupted, the other checks were not made"
    elif counts[Status.FAIL]:
        verdict = "not ready"
    elif counts[Status.WARN]:
        verdict = "usable, with warnings"
    else:
        verdict = "ready"
    return f"{verdict}: " + ", ".join(f"{counts[status]} {status.value}" for status in Status)
