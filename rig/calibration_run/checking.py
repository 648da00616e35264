"""What a finished calibration is checked with: small motions and poses that no fit has seen."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.pose_planning import PlannedPose, tour
from rig.calibration.wiggle import Wiggle, wiggle_steps
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.mover import Mover
from rig.calibration_run.stills import Photographer, Still
from rig.calibration_run.watching import PoseReport

FloatArray = NDArray[np.float64]

SMALL_MOTIONS = len(wiggle_steps())


def small_motions(
    mover: Mover, photographer: Photographer, home: FloatArray, done: Callable[[float], None]
) -> list[Wiggle]:
    """Views before and after a small motion along and about each of the tool's axes.

    They begin at ``home`` (4, 4), where the arm is left as well.
    """
    wiggles = []
    for axis, step in enumerate(wiggle_steps()):
        mover.go_to(home)
        before = photographer.take()
        mover.go_to(home @ se3.exp(step))
        wiggles.append(Wiggle(axis, before.view, photographer.take().view))
        done(axis + 1)
    mover.go_to(home)
    return wiggles


def fresh_stills(
    mover: Mover,
    photographer: Photographer,
    poses: Sequence[PlannedPose],
    wanted: int,
    report: Callable[[PoseReport], None],
) -> list[Still]:
    """Stills from up to ``wanted`` of the poses; raises CalibrationError when there is none."""
    stills: list[Still] = []
    reasons: list[str] = []
    for pose in tour(poses, mover.T_base_tool):
        if len(stills) == wanted:
            break
        problem = ""
        try:
            mover.go_to(pose.T_base_tool)
            stills.append(photographer.take())
        except (PoseRefusedError, CalibrationError) as error:
            problem = str(error)
            reasons.append(problem)
        report(PoseReport(len(stills), wanted, pose, problem))
    if not stills:
        raise CalibrationError(f"no fresh pose showed the board: {reasons[0]}")
    return stills
