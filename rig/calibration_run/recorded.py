"""Everything that a calibration sees and does, in a log beside what it collects.

The devices are wrapped: who uses them does not know.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.clock import time_of_day_offset_ns
from drivers.interfaces import Arm, ArmState, Camera, Frame, JointArm, Joints
from estimator.image.feature import Measurement
from rig.calibration_run.bench import Bench
from rig.calibration_run.watching import PoseReport, Progress
from rig.config import RigConfig
from rig.log.header import LogHeader
from rig.log.run_log import RunLog, open_log_file
from rig.vision import Sighting

FloatArray = NDArray[np.float64]

_NOTHING_MEASURED = Measurement(None, "")


def open_calibration_log(path: Path, config: RigConfig, bench: Bench, realtime: bool) -> RunLog:
    """Begin the log; raises ConfigError when it cannot be written."""
    header = LogHeader(
        target="board",
        config=config,
        intrinsics=bench.intrinsics,
        T_tool_camera=bench.T_tool_camera,
        realtime=realtime,
        offset_ns=time_of_day_offset_ns() if realtime else 0,
    )
    return open_log_file(path, header, bench.clock)


def recorded(bench: Bench, log: RunLog) -> Bench:
    """The same devices, everything that passes logged."""
    arm = RecordedArm(bench.arm, log, bench)
    joints = bench.arm
    if isinstance(joints, JointArm):
        arm = RecordedJointArm(bench.arm, log, bench, joints)
    return replace(bench, camera=RecordedCamera(bench.camera, log, bench), arm=arm)


class RecordedCamera:
    """A camera whose images are logged as they are read."""

    def __init__(self, camera: Camera, log: RunLog, bench: Bench) -> None:
        self._camera = camera
        self._log = log
        self._clock = bench.clock

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame, see ``Camera``."""
        frame = self._camera.read(timeout_s)
        if frame is not None:
            self._log.frame(Sighting(frame, _NOTHING_MEASURED), self._clock.now_s())
        return frame

    def close(self) -> None:
        """Release the device."""
        self._camera.close()


class RecordedArm:
    """An arm whose samples and commands are logged."""

    def __init__(self, arm: Arm, log: RunLog, bench: Bench) -> None:
        self._arm = arm
        self._log = log
        self._clock = bench.clock
        self._measured = np.zeros(6)

    def read_states(self) -> list[ArmState]:
        """Every new sample, see ``Arm``."""
        states = self._arm.read_states()
        if states:
            self._log.states(states)
            self._measured = states[-1].twist_tool
        return states

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow a tool twist, see ``Arm``; what is sent has been limited before."""
        self._arm.command_twist(twist_tool, hold_s)
        sent = np.array(twist_tool)
        self._log.command(self._clock.now_s(), sent, sent, self._measured, ())

    def tcp_offset(self) -> FloatArray | None:
        """The tool frame in the flange's, see ``Arm``."""
        return self._arm.tcp_offset()

    def stop(self) -> None:
        """Decelerate to standstill."""
        self._arm.stop()
        self._log.event(self._clock.now_s(), "stop")

    def close(self) -> None:
        """Stop and release the device."""
        self._arm.close()


class RecordedJointArm(RecordedArm):
    """The same of an arm that knows its joints."""

    def __init__(self, arm: Arm, log: RunLog, bench: Bench, joints: JointArm) -> None:
        super().__init__(arm, log, bench)
        self._joints = joints

    def joints(self) -> Joints | None:
        """The joints at the newest sample, see ``JointArm``."""
        return self._joints.joints()


class RecordedProgress:
    """Progress that is shown and logged."""

    def __init__(self, progress: Progress, log: RunLog, bench: Bench) -> None:
        self._progress = progress
        self._log = log
        self._clock = bench.clock

    def step(self, name: str, detail: str, total: float | None = None) -> None:
        """A step begins."""
        self._log.event(self._clock.now_s(), f"step {name}", detail)
        self._progress.step(name, detail, total)

    def done(self, count: float) -> None:
        """So much of the step is done; too often to be logged."""
        self._progress.done(count)

    def note(self, text: str) -> None:
        """Something worth a line."""
        self._log.event(self._clock.now_s(), "note", text)
        self._progress.note(text)

    def pose(self, report: PoseReport) -> None:
        """A pose was looked from, or skipped."""
        name = "pose skipped" if report.problem else "pose"
        detail = f"{report.number} of {report.wanted}"
        detail += f": {report.problem}" if report.problem else ""
        self._log.event(self._clock.now_s(), name, detail)
        self._progress.pose(report)
