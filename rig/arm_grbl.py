"""Serial gantries for ``rig arm``."""

import contextlib
from collections.abc import Callable

from drivers.clock import Clock
from drivers.errors import ConfigError, ConnectError, DeviceTimeoutError, OperateError
from drivers.grbl.arm import GrblArm
from drivers.grbl.link import SerialLink
from drivers.grbl.settings import GrblSettings
from drivers.grbl.stopping import stop_motion
from drivers.grbl.timing import GrblTiming
from drivers.interfaces import Arm, ArmState
from rig.arm_kits import Address, Json, own_settings

_FIRST_STATE_S = 2.0
_POLL_S = 0.02


class GrblKit:
    """A gantry under grblHAL or Grbl at ``--port``."""

    # Its twists are slopes over a window: the newest lies half of that back.
    max_state_age_s = 0.3

    def __init__(self, address: Address) -> None:
        settings = own_settings(address, GrblSettings)
        if "port" not in settings:
            raise ConfigError("--arm grbl needs --port: the gantry's serial device")
        # None of the commands expects a move of its own accord.
        self._settings = GrblSettings.model_validate({**settings, "self_test_mm": 0.0})

    def open(self, clock: Clock) -> Arm:
        """Open the port and ask the controller about itself."""
        return GrblArm(self._settings, clock)

    def status(self, clock: Clock) -> dict[str, Json]:
        """The gantry's state in words, and where it is."""
        arm = GrblArm(self._settings, clock)
        try:
            problem: str | None = None
            state: ArmState | None = None
            timing: dict[str, Json] = {}
            try:
                state = _first_state(arm, clock)
                timing = _timing_facts(arm.timing)
            except OperateError as error:
                problem = str(error)
            return {
                "controller": self._settings.port,
                "state": arm.explain(),
                "tool_position_m": None if state is None else state.T_base_tool[:3, 3].tolist(),
                **timing,
                "problem": problem,
            }
        finally:
            arm.close()

    def stop(self, clock: Clock) -> str:
        """Bring it to rest whatever moves it, and see that it is."""
        # Not through GrblArm, which has no say while something else moves the gantry.
        try:
            link = SerialLink(self._settings.port, self._settings.baud)
        except ConnectError as error:
            raise ConnectError(
                f"{error}. Nothing was stopped: should the gantry move, use the emergency stop"
            ) from error
        try:
            return stop_motion(link, clock, self._settings)
        finally:
            link.close()

    def recover(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Reset and unlock after asking."""
        arm = GrblArm(self._settings, clock)
        try:
            # What is wrong is explained below; here it only has to be known.
            with contextlib.suppress(OperateError):
                _first_state(arm, clock)
            arm.recover(confirm)
            _first_state(arm, clock)
        finally:
            arm.close()
        return f"the gantry at {self._settings.port} takes commands again; it did not move"

    def home(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Run the controller's homing cycle after asking; every axis moves."""
        arm = GrblArm(self._settings, clock)
        try:
            with contextlib.suppress(OperateError):
                _first_state(arm, clock)
            arm.home(confirm)
            tool_m = _first_state(arm, clock).T_base_tool[:3, 3]
        finally:
            arm.close()
        where = ", ".join(f"{value:.4f}" for value in tool_m)
        return f"the gantry at {self._settings.port} is homed; its tool is at ({where}) m"


def _timing_facts(timing: GrblTiming) -> dict[str, Json]:
    return {
        "round_trip_s": timing.round_trip_s,
        "state_age_s": timing.state_age_s,
        "command_delay_s": timing.command_delay_s,
        "command_delay_std_s": timing.command_delay_std_s,
        "command_delay_measured": timing.command_delay_measured,
        "bandwidth_hz": timing.bandwidth_hz,
    }


def _first_state(arm: Arm, clock: Clock) -> ArmState:
    deadline_s = clock.now_s() + _FIRST_STATE_S
    while clock.now_s() < deadline_s:
        states = arm.read_states()
        if states:
            return states[-1]
        clock.sleep_until(clock.now_s() + _POLL_S)
    raise DeviceTimeoutError("the gantry reports no position: check that it is powered")
