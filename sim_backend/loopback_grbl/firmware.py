"""The controller: bytes in, bytes out, on the caller's clock; no thread, no device."""

from collections import deque

import numpy as np

from sim_backend.history import JointHistory
from sim_backend.loopback_grbl import gcode
from sim_backend.loopback_grbl.interpreter import Interpreter
from sim_backend.loopback_grbl.machine import FloatArray, Machine
from sim_backend.loopback_grbl.replies import status_report
from sim_backend.loopback_grbl.states import States
from sim_backend.loopback_grbl.wire import Wire

_TICK_S = 0.001  # of the main loop, and of the recorded true motion
_STATUS_SPACING_S = 1.0 / 160.0  # requests closer together share one answer
_STATUS_DELAY_S = 0.001
_ACTION_DELAY_S = 0.006  # from the arrival of a stop to the first effect, as measured
_ACTIONS = {0x18: "reset", 0x85: "jog cancel", 0x84: "door"}
_ACTIONS |= {ord("!"): "hold", ord("~"): "resume"}
_LONGEST_LINE = 256


class Firmware:
    """grblHAL or plain Grbl 1.1 with a gantry behind it.

    ``start`` (axes,) is the machine position at power-up. ``history`` holds the true joint
    positions on the caller's clock, a millisecond apart. Instants passed in must not decrease.
    """

    def __init__(self, machine: Machine, start: FloatArray, now_s: float, locked: bool = False):
        self._machine = machine
        self._origin_s = now_s
        self._ticks = 0
        self._random = np.random.default_rng([machine.seed, 3])
        self._in, self._out = Wire(machine.baud), Wire(machine.baud)
        self._line = bytearray()
        self._lines: deque[str] = deque()
        self._waiting_bytes = 0
        self._due: deque[tuple[float, str]] = deque()  # real-time actions about to take effect
        self._status_wanted = False
        self._status_after_s = now_s
        self._reports = 0
        self.stalled = False
        self.states = States(machine, start, locked)
        self._interpreter = Interpreter(machine, self.states)
        self.history = JointHistory(now_s, _TICK_S)
        self.history.append(machine.joints(start), np.zeros(6))

    def receive(self, data: bytes, t_s: float) -> None:
        """Bytes that the host wrote at ``t_s``."""
        self._in.put(data, t_s)

    def send(self, t_s: float) -> bytes:
        """Bytes that have reached the host by ``t_s``."""
        return b"" if self.stalled else self._out.take(t_s)

    def advance_to(self, t_s: float) -> None:
        """Let time pass."""
        while self._origin_s + (self._ticks + 1) * _TICK_S <= t_s:
            self._ticks += 1
            self._tick(self._origin_s + self._ticks * _TICK_S)

    def position(self) -> FloatArray:
        """The machine position (axes,) now, as the step counters know it."""
        return self.states.motion.counted(self.states.now_s)

    def joints(self) -> tuple[FloatArray, FloatArray]:
        """True joint positions and velocities (6,) each, now, in m, rad and per second."""
        return self.history.entries(np.array([self.history.count - 1]))

    def clear_wires(self) -> None:
        """Lose every byte under way: the cable was pulled."""
        self._in.clear()
        self._out.clear()
        self._line.clear()

    def _tick(self, t_s: float) -> None:
        states = self.states
        states.advance((t_s - self._origin_s) * self._machine.clock_rate)
        if not self.stalled:
            self._listen(t_s)
        while self._due and self._due[0][0] <= t_s:
            self.act(self._due.popleft()[1])
        self._interpret()
        states.advance(states.now_s)
        self._report(t_s)
        for text in states.take_messages():
            self._out.put(text.encode() + b"\r\n", t_s)
        position, velocity = states.motion.state(states.now_s)
        self.history.append(
            self._machine.joints(position),
            self._machine.joint_rates(velocity) * self._machine.clock_rate,
        )

    def _listen(self, t_s: float) -> None:
        """Take bytes off the wire: real-time ones act, others wait for the parser.

        A full receive buffer holds up everything behind it, real-time bytes too, as USB flow
        control does (on a bare UART bytes would be lost instead).
        """
        while (byte := self._in.next_byte(t_s)) is not None:
            if byte == ord("?"):
                if not self._status_wanted:
                    self._status_after_s = max(self._status_after_s, t_s + _STATUS_DELAY_S)
                self._status_wanted = True
            elif byte in _ACTIONS:
                self._due.append((t_s + _ACTION_DELAY_S, _ACTIONS[byte]))
            elif byte < 0x80:
                if self._rx_free() <= 0:
                    return
                self._collect(byte)
            self._in.drop_byte()

    def _collect(self, byte: int) -> None:
        if byte not in b"\r\n":
            self._line.append(byte)
            self._waiting_bytes += 1
            return
        if byte == ord("\r"):
            return
        self._lines.append(self._line.decode("ascii"))
        self._waiting_bytes += 1
        self._line.clear()

    def _rx_free(self) -> int:
        return self._machine.rx_bytes - 1 - self._waiting_bytes

    def act(self, action: str) -> None:
        """A real-time action takes effect, from the wire or a button on the machine."""
        states = self.states
        if action == "reset":
            self._drop_input()
            self._interpreter.reset()
            states.reset()
        elif action == "jog cancel":
            if states.cancel_jog():
                self._drop_input()
        elif action == "hold":
            # grblHAL ignores a hold while jogging; plain Grbl takes it for a jog cancel.
            if states.state != "Jog":
                states.hold()
            elif self._machine.flavour == "Grbl" and states.cancel_jog():
                self._drop_input()
        elif action == "resume":
            states.resume()
        else:
            states.open_door()

    def _drop_input(self) -> None:
        """A cancel or reset flushes the received lines; they get no ``ok``."""
        self._lines.clear()
        self._line.clear()
        self._waiting_bytes = 0

    def _interpret(self) -> None:
        """Work off lines while the planner has room; nothing is parsed in a hold."""
        states = self.states
        while self._lines and states.accepts_lines and states.motion.planner.free > 0:
            line = self._lines.popleft()
            self._waiting_bytes -= len(line) + 1
            if len(line) > _LONGEST_LINE:
                states.say(f"error:{gcode.LINE_TOO_LONG}")
            else:
                self._interpreter.execute(line)

    def _report(self, t_s: float) -> None:
        if not self._status_wanted or t_s < self._status_after_s or self.stalled:
            return
        self._status_wanted = False
        self._status_after_s = t_s + _STATUS_SPACING_S
        if self._random.random() < self._machine.lost_status:
            return
        states = self.states
        self._reports += 1
        report = status_report(
            states.shown,
            states.motion.counted(states.now_s),
            states.motion.planner.free,
            self._rx_free(),
            states.motion.prepared_speed * 60.0,
            states.pins,
            self._reports,
        )
        self._out.put(report.encode() + b"\r\n", t_s)
