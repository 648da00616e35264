"""How long an arm moved on, against what is asked: over many random moments of one kind."""

from dataclasses import dataclass, field

import numpy as np

from tests.rig.loopback_run import Result
from tests.rig.loopback_served import ArmKind

SPEED_M_S = 0.05
# Asked of every ending: at rest so long after it, plus the time that braking takes.
REACTION_S = 0.15
# From SPEED_M_S down the rig's own ramp (safety.max_linear_acceleration_m_s2), and what the
# joints' lag or the firmware's prepared segments add to it.
RAMP_S: dict[ArmKind, float] = {"ur": 0.05 + 0.05, "grbl": 0.10 + 0.06}
# The controller's own watchdog; a gantry has none, only a short queue in its place.
WATCHDOG_S: dict[ArmKind, float] = {"ur": 0.1, "grbl": 0.155}
# One moment may fall where the host does something else; most may not.
HOST_IS_BUSY_S = 0.1


@dataclass
class Stops:
    """The figures of one kind of ending on one arm."""

    arm: ArmKind
    kind: str
    rest_s: list[float] = field(default_factory=list)
    exit_codes: list[int] = field(default_factory=list)

    def add(self, rest_s: float, result: Result) -> None:
        """Note one; a line of it is printed for whoever runs with ``-s``."""
        self.rest_s.append(rest_s)
        self.exit_codes.append(result.exit_code)
        said = None if result.summary is None else result.summary["error"]
        print(
            f"{self.kind} {self.arm} {len(self.rest_s)}: at rest after {1e3 * rest_s:.0f} ms, "
            f"exit {result.exit_code}, {said or ''!r}",
            flush=True,
        )

    def assert_within(self, asked_s: float) -> None:
        """The median within what is asked, each one within that and a busy host's delay."""
        median_s, longest_s = float(np.median(self.rest_s)), max(self.rest_s)
        print(
            f"{self.kind} {self.arm}: {len(self.rest_s)} moments, at rest after "
            f"{1e3 * median_s:.0f} ms median, {1e3 * longest_s:.0f} ms at most (asked "
            f"{1e3 * asked_s:.0f}), exit codes {sorted(set(self.exit_codes))}",
            flush=True,
        )
        assert median_s < asked_s
        assert longest_s < asked_s + HOST_IS_BUSY_S


def assert_complete(result: Result) -> None:
    """The log and the summary say how it ended, one JSON object is on stdout, nothing is left."""
    assert result.left_behind == []
    assert result.events()[0] == "started"
    assert result.log[-1]["kind"] == "event" and result.log[-1]["event"] == "ended"
    assert result.summary is not None
    assert result.summary["ending"]
    assert result.stdout.count("\n") == 1 and result.stdout.startswith("{")
