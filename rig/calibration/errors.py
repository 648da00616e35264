"""Why a calibration gave no result."""

from drivers.errors import RigError


class CalibrationError(RigError):
    """The data do not support a calibration; the message says what to do to get one."""


class ScaleError(CalibrationError):
    """The arm's motion contradicts the size of the board."""
