"""A log as plain records: what exports and tests read."""

from collections.abc import Iterator
from typing import Any

from rig.log.columns import FOR_VIEWERS
from rig.log.reader import Log
from rig.log.topics import RECORDS


def lines(log: Log) -> Iterator[dict[str, Any]]:
    """Every record but images: its kind, when it was true and logged, and what it says."""
    for record in log.records(RECORDS):
        values = record.values()
        if record.kind == "event":
            values = {key: value for key, value in values.items() if key not in FOR_VIEWERS}
        yield {"kind": record.kind, **values, "logged_ns": record.logged_ns}
