"""Universal Robots arms for ``rig arm``."""

from collections.abc import Callable

import numpy as np

from drivers.clock import Clock
from drivers.errors import ConfigError
from drivers.interfaces import Arm
from drivers.ur.arm import UrArm
from drivers.ur.kinematics import UNGUARDED
from drivers.ur.recovery import recover_controller
from drivers.ur.settings import UrSettings
from drivers.ur.status import read_status
from drivers.ur.stopping import stop_arm
from rig.arm_kits import Address, Json, own_settings


class UrKit:
    """A UR arm at ``--host``."""

    max_state_age_s = 0.1

    def __init__(self, address: Address) -> None:
        settings = own_settings(address, UrSettings)
        if "host" not in settings:
            raise ConfigError("--arm ur needs --host: the controller's address")
        self._settings = UrSettings.model_validate(settings)

    def open(self, clock: Clock) -> Arm:
        """Connect, upload the control program, arm its watchdog."""
        return UrArm(self._settings, clock)

    def status(self, clock: Clock) -> dict[str, Json]:
        """Listen only; nothing is uploaded."""
        status = read_status(self._settings.host, clock)
        known_tcp = bool(np.all(np.isfinite(status.tcp_offset)))
        return {
            "controller": f"{status.model} {status.version}".strip(),
            "serial_number": status.serial_number,
            "safety": status.safety,
            "mode": status.robot_mode,
            "program": status.program,
            "remote_control": status.remote_control,
            "speed_scaling": status.speed_scaling,
            "joints_rad": status.q_rad.tolist(),
            "tool_position_m": status.T_base_tool[:3, 3].tolist(),
            "tool_rotation": status.T_base_tool[:3, :3].tolist(),
            "twist_base": status.twist_base.tolist(),
            "tcp_offset": status.tcp_offset.tolist() if known_tcp else None,
            "kinematics": status.kinematics,
            # Without its TCP the model cannot be told, which says nothing about the arm.
            "unguarded": UNGUARDED if status.kinematics is None and known_tcp else None,
            "state_rate_hz": status.rate_hz,
            "longest_gap_s": status.longest_gap_s,
            "problem": status.problem,
        }

    def stop(self, clock: Clock) -> str:
        """Stop the controller's program over its dashboard, and see the arm at rest."""
        return stop_arm(self._settings.host, clock)

    def recover(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Unlock and power up, then prove with a command of zero that the arm takes commands."""
        recover_controller(self._settings.host, clock, confirm)
        arm = UrArm(self._settings, clock)
        try:
            arm.command_twist(np.zeros(6), 0.1)
            clock.sleep_until(clock.now_s() + 0.1)
            arm.read_states()
        finally:
            arm.close()
        return f"the arm at {self._settings.host} takes commands again; it did not move"

    def home(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Refuse."""
        raise ConfigError(
            "a UR arm knows where its joints are when it is switched on: there is nothing to "
            "home, and nothing moved"
        )
