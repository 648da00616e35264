"""The controller's words and bits for its state; source: the RTDE and dashboard guides."""

from enum import IntEnum


class SafetyMode(IntEnum):
    """Value of ``safety_mode``; the name is what the dashboard says."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7


class RobotMode(IntEnum):
    """Value of ``robot_mode``."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


class RuntimeState(IntEnum):
    """Value of ``runtime_state``."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


_BITS = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
}


def safety_status_bits(mode: SafetyMode) -> int:
    """The ``safety_status_bits`` of a mode."""
    return _BITS[mode]


def robot_status_bits(mode: RobotMode, runtime: RuntimeState) -> int:
    """The ``robot_status_bits``: power on, program running."""
    return int(mode is not RobotMode.POWER_OFF) | int(runtime is RuntimeState.PLAYING) << 1
