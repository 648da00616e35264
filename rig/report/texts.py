"""Numbers and words as the page shows them."""

import html
import json
from collections.abc import Mapping
from datetime import datetime

from rig.records import Json


def escape(text: str) -> str:
    """Text that may stand anywhere in the page."""
    return html.escape(text)


def figure(value: float | None, pattern: str, factor: float = 1.0) -> str:
    """A number, or a dash where it is unknown."""
    return "–" if value is None else pattern.format(value * factor)


def json_text(value: Json) -> str:
    """A value exactly as ``summary.json`` has it."""
    return json.dumps(value, ensure_ascii=False)


def date_text(started_at: str) -> str:
    """``YYYYmmdd-HHMMSS`` as people write it."""
    try:
        return f"{datetime.strptime(started_at, '%Y%m%d-%H%M%S'):%Y-%m-%d %H:%M:%S}"
    except ValueError:
        return started_at


def number(summary: Mapping[str, Json], key: str) -> float | None:
    """A figure of the summary; None where it is unknown."""
    value = summary.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
