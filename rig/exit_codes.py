"""What the process's exit status means; printed by each command's ``--help``."""

from enum import IntEnum

from drivers.errors import ConfigError, ConnectError, OperateError, RigError, SafetyError
from rig.calibration.errors import CalibrationError, UnusableCalibrationError
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


_WORDS = {
    ExitCode.INTERNAL: "internal error",
    ExitCode.CONFIG: "wrong usage or configuration",
    ExitCode.DEVICE: "device failure",
    ExitCode.TARGET_LOST: "target lost or never found",
    ExitCode.SAFETY: "safety stop",
    ExitCode.CALIBRATION: "no usable calibration",
    ExitCode.INTERRUPTED: "interrupted",
}
_EVERY = {ExitCode.INTERNAL, ExitCode.CONFIG, ExitCode.INTERRUPTED}


def exit_codes(done: str, *own: ExitCode) -> str:
    """The line of ``--help`` for a command that, apart from what each may, ends with its ``own``.

    ``done`` says what 0 means.
    """
    meant = [f"{code:d} {text}" for code, text in _WORDS.items() if code in _EVERY or code in own]
    return f"Exit codes: {', '.join([f'0 {done}', *meant])}."


HELP = exit_codes(
    "a radius was obtained",
    ExitCode.DEVICE,
    ExitCode.TARGET_LOST,
    ExitCode.SAFETY,
    ExitCode.CALIBRATION,
)
PLAIN = exit_codes("done")
WITH_DEVICE = exit_codes("done", ExitCode.DEVICE)
MOVING = exit_codes("done", ExitCode.DEVICE, ExitCode.SAFETY)
CALIBRATING = exit_codes(
    "the step is done; of a whole calibration: it may be used",
    ExitCode.DEVICE,
    ExitCode.SAFETY,
    ExitCode.CALIBRATION,
)
CALIBRATE_HELP = (
    "Exit codes: 0 done, and whatever is complete passed, 1 internal error, 2 wrong usage or "
    "configuration, 3 device failure, 5 safety stop, 6 the calibration failed, 130 interrupted."
)


def exit_code_of(error: RigError) -> ExitCode:
    """The exit status that an error of the rig ends the process with."""
    if isinstance(error, UnusableCalibrationError):
        return ExitCode.CALIBRATION
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
