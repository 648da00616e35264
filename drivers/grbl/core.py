"""The driver without its thread and port: bytes in, bytes out, states and failures.

Every method takes the present instant; nothing here waits. ``receive`` what the port had, then
write what ``transmit`` returns, as often as convenient (every 2 ms is plenty).
"""

from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivers.errors import RigError
from drivers.grbl import faults
from drivers.grbl.command import Commander
from drivers.grbl.controller import Controller, longest_line_bytes
from drivers.grbl.delay import DelayMeter
from drivers.grbl.errors import SilentError
from drivers.grbl.flow import Flow
from drivers.grbl.kinematics import GantryKinematics
from drivers.grbl.measure import MotionMeter
from drivers.grbl.polling import Polling
from drivers.grbl.protocol import (
    AlarmMessage,
    Banner,
    Line,
    LineReader,
    Ok,
    Refusal,
    Status,
    parse,
)
from drivers.grbl.settings import AxisSettings, GrblSettings
from drivers.grbl.stream import JogStream
from drivers.grbl.timing import stamp_std_s
from drivers.interfaces import ArmState, Joints

FloatArray = NDArray[np.float64]

JOG_CANCEL = b"\x85"
# A report begun this long after a cancel was written knows of it.
_CANCEL_SEEN_S = 0.020
_CANCEL_AGAIN_S = 0.150
# At rest the controller prepares 90 ms as soon as it has a block, planned to end at rest while
# it is the last one: only a first block longer than that begins smoothly.
_PREPARED_S = 0.090
_FIRST_BLOCK_S = 0.110


class _Mode(Enum):
    FOLLOW = "follow"  # the newest command, or rest
    CANCEL = "cancel"  # a jog cancel is due
    SETTLE = "settle"  # cancelled: wait for rest, then start from where that is


class Core:
    """Follows the newest twist by streamed jogs, measures, and notices what goes wrong.

    ``failure`` stays until a new Core is made after a recovery: no old motion ever resumes.
    """

    def __init__(
        self,
        settings: GrblSettings,
        axes: tuple[AxisSettings, ...],
        controller: Controller,
        now_s: float,
        segment_s: float,
        lookahead_s: float,
    ) -> None:
        self._controller = controller
        self._settings = settings
        kinematics = GantryKinematics(axes, settings.wrist)
        self._stream = JogStream(controller, segment_s)
        self._stream.resync(controller.mpos)
        self._commander = Commander(settings, axes, controller, kinematics, lookahead_s)
        self._flow = Flow(controller.planner_blocks)
        # A further line fits while the unacknowledged ones leave it room, at the longest.
        most = min(settings.max_ahead_bytes, controller.rx_bytes)
        self._ahead_bytes = max(most - longest_line_bytes(len(axes)), 1)
        step, stamp_s = 1.0 / controller.steps_per_unit, stamp_std_s(controller)
        self._meter = MotionMeter(kinematics, settings.twist_window_s, step, stamp_s)
        # Commands act later than what is kept ahead of the motors.
        self.delay = DelayMeter(2.0 * lookahead_s + _PREPARED_S, segment_s, stamp_s)
        self._reader = LineReader(settings.baud)
        self._polling = Polling(settings.poll_hz, settings.silence_s, now_s)
        self._mode = _Mode.SETTLE  # the first thing to know is where it stands
        self._cancelled_s = now_s
        self._settling_since_s: float | None = now_s
        self._rest: FloatArray | None = None  # reported position while settling
        self._states: list[ArmState] = []
        self.status: Status | None = None
        self.failure: RigError | None = None

    @property
    def settled(self) -> bool:
        """Whether the last stop has been seen to end at rest."""
        return self._mode is _Mode.FOLLOW

    def take_states(self) -> list[ArmState]:
        """The states measured since the last call."""
        taken, self._states = self._states, []
        return taken

    def joints(self) -> Joints | None:
        """The joints at the newest report; None before the first."""
        if self.status is None or self.status.position is None:
            return None
        return self._commander.joints_at(self._controller.pick(self.status.position))

    def command(self, twist_tool: FloatArray, hold_s: float, now_s: float) -> None:
        """Follow ``twist_tool`` (6,) until ``hold_s`` after ``now_s``.

        Raises MotionError or LimitError, having asked for a stop, where the gantry cannot.
        """
        try:
            self._commander.set(twist_tool, hold_s, now_s, self._stream.target)
        except RigError:
            self.stop()
            raise
        if self._mode is _Mode.FOLLOW:
            self.delay.commanded(now_s, twist_tool)

    def stop(self) -> None:
        """Cancel the jog; safe at any time, and once is enough."""
        self._commander.clear()
        self.delay.restart()
        if self._mode is _Mode.FOLLOW:
            self._mode = _Mode.CANCEL

    def fail(self, error: RigError) -> None:
        """Give up with ``error``, the first one winning, and stop."""
        if self.failure is None:
            self.failure = error
            self.stop()

    def receive(self, data: bytes, now_s: float) -> None:
        """Take what the controller sent; its last byte arrived at ``now_s``."""
        for line in self._reader.feed(data, now_s):
            self._hear(line, now_s)

    def transmit(self, now_s: float) -> bytes:
        """What to write now."""
        if self._polling.silent(now_s):
            self.fail(
                SilentError(
                    f"the gantry on {self._settings.port} has not answered for "
                    f"{self._settings.silence_s:g} s: check its power and cable"
                )
            )
        if self._mode is _Mode.FOLLOW and self._commander.expired(now_s):
            expired = self._flow.ahead_s(now_s) > 0.0 or not self._reported_idle()
            self._commander.clear()
            self.delay.restart()
            if expired:
                self._mode = _Mode.CANCEL
        out = self._cancel(now_s)
        out += self._polling.request(now_s)
        if self._mode is _Mode.FOLLOW and self.failure is None:
            out += self._jogs(now_s)
        return out

    def _hear(self, line: Line, now_s: float) -> None:
        message = parse(line.text)
        match message:
            case Status():
                self._polling.answered(now_s)
                self._take_status(message, line.begun_s, now_s)
            case Ok():
                self._polling.heard(now_s)
                self._flow.acknowledged(now_s)
            case Refusal() | AlarmMessage() | Banner():
                self._polling.heard(now_s)
                self._flow.acknowledged(now_s)
                # While a cancel is under way, lines it overtook may still be refused.
                if self._mode is _Mode.FOLLOW or not isinstance(message, Refusal):
                    self.fail(faults.from_message(message, self._settings.port))

    def _take_status(self, status: Status, true_s: float, now_s: float) -> None:
        if status.homed is None and self.status is not None:
            status = replace(status, homed=self.status.homed)
        if status.position is None or len(status.position) <= max(self._controller.columns):
            return
        self.status = status
        mpos = self._controller.pick(status.position)
        state = self._meter.add(true_s, mpos)
        if state is not None:
            self._states.append(state)
            self.delay.measured(state)
        error = faults.from_status(status, self._settings.port, self._mode is not _Mode.FOLLOW)
        if error is not None:
            self.fail(error)
        if self._mode is _Mode.SETTLE:
            self._settle(status, mpos, true_s, now_s)
        elif status.blocks_free is not None:
            self._flow.reported(status.blocks_free, true_s)

    def _settle(self, status: Status, mpos: FloatArray, true_s: float, now_s: float) -> None:
        """Leave a stop once two reports after it agree that nothing moves."""
        if true_s < self._cancelled_s + _CANCEL_SEEN_S:
            return
        if status.state == "Idle":
            if self._rest is not None and np.array_equal(self._rest, mpos):
                self._stream.resync(mpos)
                self._flow.clear()
                self._mode, self._settling_since_s = _Mode.FOLLOW, None
            self._rest = mpos
            return
        self._rest = None
        if status.state == "Jog" and now_s - self._cancelled_s > _CANCEL_AGAIN_S:
            self._mode = _Mode.CANCEL  # a line behind the cancel started again
        since_s = now_s if self._settling_since_s is None else self._settling_since_s
        if now_s - since_s > self._settings.rest_timeout_s:
            self.fail(faults.no_rest(status, self._settings.port))

    def _cancel(self, now_s: float) -> bytes:
        if self._mode is not _Mode.CANCEL:
            return b""
        if self._settling_since_s is None:
            self._settling_since_s = now_s
        self._mode, self._rest, self._cancelled_s = _Mode.SETTLE, None, now_s
        # Flushed lines get no ok, so the count starts anew.
        self._flow.clear()
        return JOG_CANCEL

    def _jogs(self, now_s: float) -> bytes:
        """Blocks at the newest rates while less than the look-ahead is under way."""
        out = b""
        while self._flow.unacknowledged_bytes <= self._ahead_bytes:
            plan = self._commander.plan(self._stream.target, now_s)
            ahead_s = self._flow.ahead_s(now_s)
            if ahead_s >= plan.lookahead_s:
                break
            starting = ahead_s == 0.0 and self._reported_idle()
            block = self._stream.next(plan.rates, now_s, _FIRST_BLOCK_S if starting else 0.0)
            if block is None:
                break
            prepared_s = _PREPARED_S if starting else 0.0
            self._flow.sent(block.duration_s - prepared_s, len(block.line))
            out += block.line
        return out

    def _reported_idle(self) -> bool:
        return self.status is not None and self.status.state == "Idle"
