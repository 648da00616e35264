"""What ``rig arm`` prints: a table, or the same facts as plain data."""

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from rig.jog import JogResult


def jog_facts(result: "JogResult", frame: str) -> dict[str, Any]:
    """What a jog did, by name; twists in the frame that was asked for."""
    import numpy as np

    error = result.measured - result.commanded
    return {
        "frame": frame,
        "commanded": result.commanded.tolist(),
        "allowed": result.allowed.tolist(),
        "measured": result.measured.tolist(),
        "linear_error_m_s": float(np.linalg.norm(error[:3])),
        "angular_error_rad_s": float(np.linalg.norm(error[3:])),
        "limited_by": list(result.limited_by),
        "latency_s": result.latency_s,
        "stop_s": result.stop_s,
        "moved_m": result.moved_m,
        "states": result.states,
        "state_rate_hz": result.state_rate_hz,
        "overruns": result.overruns,
        "interrupted": result.interrupted,
    }


def arm_table(title: str, facts: dict[str, Any]) -> Table:
    """The facts, a row each."""
    table = Table(title=title, show_header=False)
    for name, value in facts.items():
        table.add_row(name.replace("_", " "), Text(_words(value)))  # brackets are no markup
    return table


def _words(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "[" + ", ".join(_words(part) for part in value) + "]" if value else "–"
    return "–" if value is None else str(value)
