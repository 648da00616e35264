"""What a person sees of a calibration: bars on a terminal, plain lines anywhere else."""

import io

import numpy as np
from rich.console import Console

from rig.calibration.pose_planning import PlannedPose
from rig.calibration_run.progress import ConsoleProgress
from rig.calibration_run.watching import PoseReport

POSE = PlannedPose(np.eye(4), 3.2, 20, 0.5, 0.31)


def shown(terminal: bool) -> str:
    file = io.StringIO()
    console = Console(file=file, force_terminal=terminal, width=160, color_system=None)
    with ConsoleProgress(console) as progress:
        progress.step("poses", "1 of 3 are there", 3)
        progress.pose(PoseReport(2, 3, POSE, ""))
        progress.pose(PoseReport(2, 3, POSE, "blocked by: joint spin max"))
        progress.step("fit", "intrinsics and hand-eye")
        progress.note("only 2 of 3 poses")
    return file.getvalue()


def test_every_pose_is_told_with_what_it_adds_or_why_it_was_skipped() -> None:
    for terminal in (True, False):
        text = shown(terminal)
        assert "2/3  31 cm, tilted 29°, 20 corners expected, adds 3.2 bit" in text
        assert "skipped: blocked by: joint spin max" in text
        assert "only 2 of 3 poses" in text


def test_a_terminal_gets_a_bar_for_every_step() -> None:
    text = shown(terminal=True)
    assert "━" in text
    last = text[text.rindex("poses: 1 of 3") :]
    assert "3/3" in last  # done, so the bar is full
    assert "fit: intrinsics and hand-eye" in last


def test_a_file_gets_lines_and_no_control_characters() -> None:
    text = shown(terminal=False)
    assert text.splitlines()[0] == "poses: 1 of 3 are there"
    assert "\x1b" not in text and "━" not in text
