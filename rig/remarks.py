"""What a connected arm has to say about itself before it moves."""

import sys

from drivers.interfaces import Arm, RemarkingArm


def tell_remarks(arm: Arm) -> tuple[str, ...]:
    """The arm's remarks, told once on stderr: what is not guarded on it, or only assumed of it."""
    remarks = arm.remarks() if isinstance(arm, RemarkingArm) else ()
    for remark in remarks:
        print(f"warning: {remark}", file=sys.stderr)
    return remarks
