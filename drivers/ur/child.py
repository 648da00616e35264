"""The process that talks to the arm.

It ends, with the arm braked and the program stopped, when told to and when its parent dies.
Should it die itself, the controller's watchdog stops the arm.
"""

import contextlib
import os
import select
import socket
import sys
import threading

import numpy as np

from drivers.clock import Clock, WallClock
from drivers.errors import ConnectError, RigError
from drivers.ur.commander import Commander
from drivers.ur.faults import PROGRAM_PLAYING, fault_of
from drivers.ur.messages import MOST_BYTES, Event, Order, command_of
from drivers.ur.motor import Motor
from drivers.ur.receiver import Receiver
from drivers.ur.recovery import stop_controller
from drivers.ur.ring import Sample, SampleRing
from drivers.ur.rtde_stream import RtdeStream
from drivers.ur.settings import UrSettings

_IDLE_PERIOD_S = 0.02  # of feeding the watchdog while nothing moved yet
_BRAKE_TIMEOUT_S = 1.5
_END_TIMEOUT_S = 3.0
_PRIORITY = 10
_FIRST_SAMPLE_S = 2.0
_LAST_STOP_TIMEOUT_S = 0.3
_AT_REST = 5e-3  # m/s and rad/s: slow enough to stop speed mode without tripping the watchdog


class Child:
    """The loop between the parent's orders and the controller."""

    def __init__(self, settings: UrSettings, parent: socket.socket, ring: SampleRing) -> None:
        self._settings = settings
        self._parent = parent
        self._ring = ring
        self._clock: Clock = WallClock()
        self._commander = Commander(settings)
        self._ending = False

    def run(self) -> int:
        """Connect, report, obey until the end; the exit status."""
        settings = self._settings
        try:
            stream = RtdeStream(settings.host, self._clock, settings.connect_timeout_s)
            receiver = Receiver(stream, self._ring, self._lost)
            self._require_health()
            motor = Motor(settings.host, 1.0 / stream.rate_hz, settings.watchdog_hz)
            tcp_offset = motor.tcp_offset()
        except RigError as error:
            self._tell(Event("refused", str(error)))
            return 1
        facts = (tcp_offset, stream.version, stream.rate_hz, stream.round_trip_s)
        self._tell(Event("ready", "", *facts))
        try:
            while not self._ending:
                self._turn(motor)
            self._brake(motor)
            _abandon_after(_END_TIMEOUT_S)
            motor.end()
        except RigError as error:
            self._lost(str(error))
        receiver.stop()
        return 0

    def _require_health(self) -> None:
        """Raise ConnectError, in words, where the vendor's code would wait 5 s and give up."""
        host = self._settings.host
        deadline_s = self._clock.now_s() + _FIRST_SAMPLE_S
        while (sample := self._newest()) is None:
            if self._clock.now_s() > deadline_s:
                raise ConnectError(f"the arm at {host} accepts connections but reports no state")
            self._clock.sleep_until(self._clock.now_s() + 0.005)
        fault = fault_of(host, sample.safety_status_bits, sample.robot_mode, PROGRAM_PLAYING)
        if fault is not None:
            raise ConnectError(str(fault))

    def _turn(self, motor: Motor) -> None:
        """Send what is due, then wait for the next order or the next time to send."""
        now_s = self._clock.now_s()
        speed = self._commander.output(now_s, self._newest())
        motor.send(speed)
        period_s = _IDLE_PERIOD_S if speed is None else self._settings.resend_period_s
        self._obey(now_s + period_s)

    def _obey(self, until_s: float) -> None:
        """Take orders until ``until_s``, or until one arrived: it is acted upon at once."""
        remaining_s = max(0.0, until_s - self._clock.now_s())
        readable, _, _ = select.select([self._parent], [], [], remaining_s)
        while readable and not self._ending:
            try:
                packet = self._parent.recv(MOST_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            if not packet:  # the parent died
                self._ending = True
                return
            command = command_of(packet)
            if command.order is Order.TWIST:
                self._commander.command(command.twist_tool, command.until_s)
            else:
                self._commander.stop()
            self._ending = command.order is Order.CLOSE

    def _brake(self, motor: Motor) -> None:
        """Send zeros until the arm is measured at rest."""
        self._commander.stop()
        deadline_s = self._clock.now_s() + _BRAKE_TIMEOUT_S
        while self._clock.now_s() < deadline_s:
            sample = self._newest()
            speed = self._commander.output(self._clock.now_s(), sample)
            motor.send(speed)
            if sample is not None and float(np.abs(sample.twist_base).max()) < _AT_REST:
                return
            self._clock.sleep_until(self._clock.now_s() + self._settings.resend_period_s)

    def _newest(self) -> Sample | None:
        return self._ring.newest()

    def _lost(self, reason: str) -> None:
        """Report, stop the program by another way in if there is one, and leave at once.

        Left alone the vendor's code would reconnect and upload again by itself, without a
        watchdog, or crash.
        """
        if self._ending:
            return
        self._tell(Event("lost", reason))
        with contextlib.suppress(ConnectError):
            stop_controller(self._settings.host, _LAST_STOP_TIMEOUT_S)
        os._exit(1)

    def _tell(self, event: Event) -> None:
        try:
            self._parent.send(event.to_bytes(), socket.MSG_DONTWAIT)
        except OSError:
            self._ending = True  # nobody listens any more


def _abandon_after(timeout_s: float) -> None:
    """Leave the process after ``timeout_s`` whatever the vendor's code waits for."""
    timer = threading.Timer(timeout_s, os._exit, (1,))
    timer.daemon = True
    timer.start()


def main() -> None:
    """Arguments: the parent's socket, the ring's file, the settings as JSON."""
    # Little work that must not wait; where the system does not grant it, it goes on without.
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    parent = socket.socket(fileno=int(sys.argv[1]))
    ring = SampleRing(int(sys.argv[2]))
    settings = UrSettings.model_validate_json(sys.argv[3])
    status = Child(settings, parent, ring).run()
    sys.stdout.flush()
    # Not through the interpreter's end: the vendor's threads may still run and crash it.
    os._exit(status)
