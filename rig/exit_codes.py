"""What the process's exit status means; printed by ``rig run --help``."""

from enum import IntEnum

from drivers.errors import ConfigError, ConnectError, OperateError, RigError, SafetyError
from rig.calibration.errors import CalibrationError
from rig.calibration_run.errors import StopRequestedError


class ExitCode(IntEnum):
    """Exit statuses of every ``rig`` command."""

    OK = 0
    INTERNAL = 1
    CONFIG = 2
    DEVICE = 3
    TARGET_LOST = 4
    SAFETY = 5
    CALIBRATION = 6
    INTERRUPTED = 130


HELP = (
    "Exit codes: 0 a radius was obtained, 1 internal error, 2 wrong usage or configuration, "
    "3 device failure, 4 target lost or never found, 5 safety stop, 6 no usable calibration, "
    "130 interrupted."
)


def exit_code_of(error: RigError) -> ExitCode:
    """The exit status that an error of the rig ends the process with."""
    if isinstance(error, ConfigError):
        return ExitCode.CONFIG
    if isinstance(error, SafetyError):
        return ExitCode.SAFETY
    if isinstance(error, CalibrationError):
        return ExitCode.CALIBRATION
    if isinstance(error, StopRequestedError):
        return ExitCode.INTERRUPTED
    if isinstance(error, ConnectError | OperateError):
        return ExitCode.DEVICE
    return ExitCode.INTERNAL
