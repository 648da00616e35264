"""A run's log as the tests read it."""

from pathlib import Path
from typing import Any

from rig.log.lines import lines
from rig.log.reader import open_log
from rig.log.run_log import LOG_NAME


def log_lines(run_dir: Path) -> list[dict[str, Any]]:
    """Every record but images; empty when there is no log, or nothing readable in it yet."""
    path = run_dir / LOG_NAME
    if not path.is_file() or path.stat().st_size < 8:
        return []
    return list(lines(open_log(path)))


def log_bytes(run_dir: Path) -> bytes:
    """The file itself."""
    return (run_dir / LOG_NAME).read_bytes()
