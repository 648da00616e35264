"""A Universal Robots arm behind the ``Arm`` interface."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConnectError, OperateError
from drivers.interfaces import ArmState, Joints
from drivers.ur.faults import (
    ArmConnectionError,
    ArmProcessError,
    ArmStalledError,
    TcpChangedError,
    fault_of,
)
from drivers.ur.geometry import to_tool_axes
from drivers.ur.kinematics import UNGUARDED, Kinematics, identify
from drivers.ur.link import ChildLink
from drivers.ur.messages import Command, Order
from drivers.ur.noise import FEWEST_SAMPLES, noise_at_rest
from drivers.ur.recovery import recover_controller
from drivers.ur.ring import Sample
from drivers.ur.settings import UrSettings

FloatArray = NDArray[np.float64]

_SAME_TCP = 1e-5  # m and rad
_REST_WAIT_S = 0.25


class UrArm:
    """The arm; a child process holds the connection, the controller's watchdog guards both.

    ``clock`` must be the machine's monotonic clock. The states' uncertainties are measured when
    connecting: of their instants from the round trip, of their twists at rest.

    Raises ConnectError when the arm cannot be reached or made ready, or when its TCP is not the
    one of ``settings.tcp_offset``.
    """

    def __init__(self, settings: UrSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._fault: OperateError | None = None
        self._closed = False
        self._open()

    def _open(self) -> None:
        self._link = ChildLink(self._settings, self._clock)
        self._next = 0  # number of the first sample not returned yet
        self._kinematics: Kinematics | None = None
        self._identified = False
        ready = self._link.ready
        self._t_std_s = ready.round_trip_s / math.sqrt(12.0)
        self._noise = noise_at_rest(self._first_samples())
        self._tcp_offset = np.array(ready.tcp_offset)
        pinned = self._settings.tcp_offset
        if pinned is not None and not _same(pinned, self._tcp_offset):
            self._link.close(_order(Order.CLOSE))
            raise ConnectError(
                f"the controller at {self._settings.host} has the TCP {_text(self._tcp_offset)}, "
                f"the rig was calibrated with {_text(pinned)}: set it back on the pendant or "
                "calibrate again"
            )

    def _first_samples(self) -> list[Sample]:
        ring, clock = self._link.ring, self._clock
        deadline_s = clock.now_s() + _REST_WAIT_S
        while ring.count < FEWEST_SAMPLES and clock.now_s() < deadline_s:
            clock.sleep_until(clock.now_s() + 0.01)
        return ring.since(0)[0]

    @property
    def child_pid(self) -> int:
        """The process that talks to the arm."""
        return self._link.pid

    @property
    def speed_scaling(self) -> float:
        """The newest speed scaling (pendant's slider and safety), 1 for full speed."""
        sample = self._link.ring.newest()
        return 1.0 if sample is None else sample.speed_scaling

    def read_states(self) -> list[ArmState]:
        """Every sample since the last call, oldest first.

        Raises the errors of ``drivers.ur.faults`` as soon as the arm, the connection or the
        child fails; they stay until ``recover``.
        """
        self._check()
        samples, self._next = self._link.ring.since(self._next)
        return [_state(sample, self._t_std_s, self._noise) for sample in samples]

    def joints(self) -> Joints | None:
        """The joints at the newest sample; None before it, or for a model not known."""
        sample = self._link.ring.newest()
        if sample is None:
            return None
        kinematics = self._identify(sample)
        return None if kinematics is None else kinematics.joints(sample.q_rad)

    def remarks(self) -> tuple[str, ...]:
        """That the model is not known, where that is so: its joints are then not guarded."""
        sample = self._link.ring.newest()
        known = sample is None or self._identify(sample) is not None
        return () if known else (UNGUARDED,)

    def _identify(self, sample: Sample) -> Kinematics | None:
        if not self._identified:
            self._kinematics = identify(sample.q_rad, sample.T_base_tool, self._tcp_offset)
            self._identified = True
        return self._kinematics

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,), held in the tool's axes, for ``hold_s`` from now.

        Raises as ``read_states`` does; a command that is not six finite numbers and a finite
        hold time stops the arm and raises OperateError.
        """
        twist = np.asarray(twist_tool, dtype=float)
        if twist.shape != (6,) or not np.all(np.isfinite(twist)) or not 0.0 <= hold_s < np.inf:
            self.stop()
            raise OperateError(
                f"UR arm: refused the twist {twist.tolist()} for {hold_s!r} s and stopped; a "
                "command is six finite numbers and a finite hold time"
            )
        self._check()
        self._link.send(Command(Order.TWIST, twist, self._clock.now_s() + hold_s))

    def tcp_offset(self) -> FloatArray:
        """The TCP that was set on the controller at connecting (6,); another one is a fault."""
        return self._tcp_offset.copy()

    def stop(self) -> None:
        """Brake to standstill; never raises, since a dead link stops through the watchdog."""
        if not self._closed:
            try:
                self._link.send(_order(Order.STOP))
            except ArmProcessError as error:
                self._latch(error)

    def close(self) -> None:
        """Brake, end the control program, end the child."""
        if not self._closed:
            self._closed = True
            self._link.close(_order(Order.CLOSE))

    def recover(self, confirm: Callable[[str], bool]) -> None:
        """Bring a stopped arm back: explain, ask, unlock, upload anew, command zero.

        ``confirm`` gets the explanation; nothing is unlocked unless it returns True. No motion
        from before comes back. Raises OperateError when that is not possible or not wanted,
        ConnectError when the controller cannot be reached.
        """
        self._link.kill()
        recover_controller(self._settings.host, self._clock, confirm)
        self._open()
        self._fault = None
        self._link.send(Command(Order.TWIST, np.zeros(6), self._clock.now_s()))

    def _check(self) -> None:
        """Raise what is wrong; the first fault is kept, because later ones follow from it."""
        if self._closed:
            raise OperateError("UR arm: used after close; open it again")
        if self._fault is None:
            self._fault = self._find_fault()
        if self._fault is not None:
            raise self._fault

    def _find_fault(self) -> OperateError | None:
        host, sample = self._settings.host, self._link.ring.newest()
        for event in self._link.events():
            if event.kind == "lost":
                return ArmConnectionError(
                    f"the connection to the arm at {host} is lost ({event.text}): check the cable "
                    "and the controller, then run `rig arm recover`"
                )
        if death := self._link.death():
            return ArmProcessError(death)
        if sample is None:
            return None
        age_s = self._clock.now_s() - sample.arrival_s
        if age_s > self._settings.max_state_age_s:
            return ArmStalledError(
                f"the arm at {host} has not reported for {age_s:.3f} s: check the network and the "
                "controller, then run `rig arm recover`"
            )
        if np.all(np.isfinite(sample.tcp_offset)) and not _same(
            sample.tcp_offset, self._tcp_offset
        ):
            return TcpChangedError(
                f"the TCP of the arm at {host} changed from {_text(self._tcp_offset)} to "
                f"{_text(sample.tcp_offset)}: the calibration no longer holds"
            )
        return fault_of(host, sample.safety_status_bits, sample.robot_mode, sample.runtime_state)

    def _latch(self, error: OperateError) -> None:
        if self._fault is None:
            self._fault = error


def _order(order: Order) -> Command:
    return Command(order, np.zeros(6), 0.0)


def _state(sample: Sample, t_std_s: float, twist_covariance: FloatArray | None) -> ArmState:
    return ArmState(
        t_s=sample.t_s,
        T_base_tool=sample.T_base_tool,
        twist_tool=to_tool_axes(sample.T_base_tool[:3, :3], sample.twist_base),
        t_std_s=t_std_s,
        twist_covariance=twist_covariance,
    )


def _same(a: FloatArray | tuple[float, ...], b: FloatArray | tuple[float, ...]) -> bool:
    return float(np.abs(np.subtract(a, b)).max()) <= _SAME_TCP


def _text(tcp: FloatArray | tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{float(value):.5f}" for value in tcp) + ")"
