"""What a check found: one row of the report."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

Value = None | bool | int | float | str


class Status(StrEnum):
    """How good it is."""

    OK = "ok"
    WARN = "warn"  # it works, but worse than it could
    FAIL = "fail"  # it keeps the rig from being used


@dataclass(frozen=True, slots=True)
class Finding:
    """One check's result; ``values`` holds the numbers of ``measured``, units in their names."""

    name: str
    status: Status
    measured: str
    advice: str = ""  # one line on what to do; empty where there is nothing
    values: Mapping[str, Value] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The row as plain data."""
        return {
            "name": self.name,
            "status": self.status.value,
            "measured": self.measured,
            "advice": self.advice,
            "values": {name: _plain(value) for name, value in self.values.items()},
        }


def finding_of(data: Mapping[str, Any]) -> Finding:
    """The inverse of ``Finding.as_json``."""
    return Finding(
        name=str(data["name"]),
        status=Status(data["status"]),
        measured=str(data["measured"]),
        advice=str(data["advice"]),
        values=dict(data["values"]),
    )


def _plain(value: Value) -> Value:
    """JSON has no word for what is not a number."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
