"""Why a calibration gave no result, or may not be used."""

from drivers.errors import ConfigError, RigError


class CalibrationError(RigError):
    """The data do not support a calibration; the message says what to do to get one."""


class ScaleError(CalibrationError):
    """The arm's motion contradicts the size of the board."""


class UnusableCalibrationError(ConfigError):
    """The rig has no calibration that holds for it as it is; the message says what to type."""
