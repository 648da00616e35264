"""``summary.json``, read back."""

import json
from pathlib import Path

from rig.records import SUMMARY_NAME, Json


def read_summary(run_dir: Path) -> dict[str, Json] | None:
    """``summary.json``, or None when the run never got that far or it was cut off in writing."""
    try:
        summary = json.loads((run_dir / SUMMARY_NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary if isinstance(summary, dict) else None
