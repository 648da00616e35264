"""Why a step of a calibration was not carried out on the rig."""

from drivers.errors import OperateError


class PoseRefusedError(OperateError):
    """The arm did not get to a pose; the message says what was in the way."""


class StopRequestedError(OperateError):
    """Somebody asked to stop; the arm rests."""
