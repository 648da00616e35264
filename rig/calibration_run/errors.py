"""Why a step of a calibration was not carried out on the rig."""

from drivers.errors import OperateError
from rig.calibration.errors import CalibrationError


class PoseRefusedError(OperateError):
    """The arm did not get to a pose; the message says what was in the way."""


class FewPicturesError(CalibrationError):
    """The camera gave too few pictures to tell whether the board rests in view."""


class StopRequestedError(OperateError):
    """Somebody asked to stop; the arm rests."""
