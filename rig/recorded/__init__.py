"""A past run, read back from its directory: the one place that knows how it was recorded.

``read_run`` is all that reports, lists and the page need; the log's format is behind it.
"""

from rig.recorded.read import read_run
from rig.recorded.record import Command, FrameEntry, RunRecord
from rig.recorded.setup import RunSetup, read_setup, write_setup

__all__ = [
    "Command",
    "FrameEntry",
    "RunRecord",
    "RunSetup",
    "read_run",
    "read_setup",
    "write_setup",
]
