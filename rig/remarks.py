"""What a connected arm has to say about itself, before it moves and afterwards."""

import contextlib
import sys

from drivers.errors import RigError
from drivers.interfaces import Arm, CommandDelay, DelayedArm, RemarkingArm
from rig.records import Json


def tell_remarks(arm: Arm) -> tuple[str, ...]:
    """The arm's remarks, told once on stderr: what is not guarded on it, or only assumed of it."""
    remarks = arm.remarks() if isinstance(arm, RemarkingArm) else ()
    for remark in remarks:
        print(f"warning: {remark}", file=sys.stderr)
    return remarks


def delay_facts(arm: Arm) -> dict[str, Json]:
    """How late the arm follows commands, by name; empty for one that does not say."""
    delay: CommandDelay | None = None
    with contextlib.suppress(RigError):  # one that failed has said so already
        delay = arm.command_delay() if isinstance(arm, DelayedArm) else None
    if delay is None:
        return {}
    return {
        "command_delay_s": delay.delay_s,
        "command_delay_std_s": delay.std_s,
        "command_delay_measured": delay.measured,
    }
