"""What can be wrong with the arm, in words and as error types.

OperateError
├── ArmConnectionError              the connection was closed or refused
├── ArmStalledError (DeviceTimeoutError)   connected, but no state arrives
├── ArmProcessError                 the process that talks to the arm died
├── ProtectiveStopError             the controller stopped to protect somebody or itself
├── EmergencyStopError              somebody pressed a red button
├── ArmStoppedError                 another safety function, or the arm has no power
├── ProgramStoppedError             the control program was stopped or paused
└── TcpChangedError                 the tool's frame is not the one of the calibration
"""

from drivers.errors import DeviceTimeoutError, OperateError


class ArmConnectionError(OperateError):
    """The connection to the controller is gone."""


class ArmStalledError(DeviceTimeoutError):
    """The controller is connected but its states stopped arriving."""


class ArmProcessError(OperateError):
    """The process that talks to the arm died; the controller's watchdog stops the arm."""


class ProtectiveStopError(OperateError):
    """The arm is in a protective stop."""


class EmergencyStopError(OperateError):
    """The arm is in an emergency stop."""


class ArmStoppedError(OperateError):
    """The safety system or the power state keeps the arm from moving."""


class ProgramStoppedError(OperateError):
    """The control program no longer runs on the controller."""


class TcpChangedError(OperateError):
    """The tool centre point on the controller changed while the arm was in use."""


# Bits of safety_status_bits; source: the RTDE guide.
_PROTECTIVE = 1 << 2
_RECOVERY = 1 << 3
_SAFEGUARD = 1 << 4
_EMERGENCY = 1 << 5 | 1 << 6 | 1 << 7
_VIOLATION_OR_FAULT = 1 << 8 | 1 << 9

_ROBOT_RUNNING = 7
PROGRAM_STOPPED = 1
PROGRAM_PLAYING = 2
_PROGRAM_PAUSED = 4

ROBOT_MODES = {
    -1: "no controller",
    0: "disconnected",
    1: "confirm safety",
    2: "booting",
    3: "power off",
    4: "power on",
    5: "idle",
    6: "backdrive",
    7: "running",
    8: "updating firmware",
}
SAFETY_MODES = {
    1: "normal",
    2: "reduced",
    3: "protective stop",
    4: "recovery",
    5: "safeguard stop",
    6: "system emergency stop",
    7: "robot emergency stop",
    8: "violation",
    9: "fault",
}
RUNTIME_STATES = {0: "stopping", 1: "stopped", 2: "playing", 3: "pausing", 4: "paused"}

_RECOVER = "look at the arm, then run `rig arm recover`"


def fault_of(
    host: str, safety_status_bits: int, robot_mode: int, runtime_state: int
) -> OperateError | None:
    """The error that the controller's own state amounts to, the gravest first; None if none."""
    arm = f"the arm at {host}"
    if safety_status_bits & _EMERGENCY:
        return EmergencyStopError(
            f"{arm} is in an emergency stop: release the button when it is safe, then {_RECOVER}"
        )
    if safety_status_bits & _VIOLATION_OR_FAULT:
        return ArmStoppedError(f"{arm} reports a safety violation or fault: {_RECOVER}")
    if safety_status_bits & _PROTECTIVE:
        return ProtectiveStopError(f"{arm} is in a protective stop: {_RECOVER}")
    if safety_status_bits & _SAFEGUARD:
        return ArmStoppedError(
            f"{arm} is in a safeguard stop: close the safeguard, then {_RECOVER}"
        )
    if safety_status_bits & _RECOVERY:
        return ArmStoppedError(
            f"{arm} is in recovery mode, outside its safety limits: jog it back at the pendant"
        )
    if robot_mode != _ROBOT_RUNNING:
        mode = ROBOT_MODES.get(robot_mode, str(robot_mode))
        return ArmStoppedError(f"{arm} cannot move, its mode is {mode!r}: {_RECOVER}")
    if runtime_state == _PROGRAM_PAUSED:
        return ProgramStoppedError(f"{arm}: the program was paused at the pendant: {_RECOVER}")
    if runtime_state != PROGRAM_PLAYING:
        return ProgramStoppedError(
            f"{arm}: the control program was stopped, at the pendant or by its watchdog: {_RECOVER}"
        )
    return None
