"""What a gantry can do to its user, as types; the messages say what to do next.

OperateError
├── GantryError            the root of these
│   ├── AlarmError         locked by an alarm: limit, emergency stop, lost position
│   ├── HeldError          held: feed hold or safety door
│   ├── ResetError         the controller restarted
│   ├── NotReadyError      found locked or held so that it cannot even be asked about itself
│   ├── RefusedError       it answered error:<code>
│   ├── LimitError         the motion leads out of a joint's range (a MotionRefusedError too)
│   ├── MotionError        a motion this gantry cannot make, or a command that is none (the same)
│   └── PortLostError      the serial port is gone
└── SilentError            the port is there, the controller does not answer
"""

from drivers.errors import DeviceTimeoutError, MotionRefusedError, OperateError
from drivers.grbl.protocol import Status


class GantryError(OperateError):
    """The gantry failed while in use."""


class AlarmError(GantryError):
    """The controller is locked by an alarm."""


class HeldError(GantryError):
    """The controller holds: somebody pressed feed hold or opened the safety door."""


class ResetError(GantryError):
    """The controller restarted by itself or at its reset button."""


class NotReadyError(GantryError):
    """The controller was found in a state in which it answers no questions; see ``status``."""

    def __init__(self, message: str, status: Status) -> None:
        super().__init__(message)
        self.status = status


class RefusedError(GantryError):
    """The controller refused a line."""


class LimitError(GantryError, MotionRefusedError):
    """The motion leads out of a joint's range."""


class MotionError(GantryError, MotionRefusedError):
    """The command is not a motion that this gantry can make."""


class PortLostError(GantryError):
    """The serial port is gone."""


class SilentError(DeviceTimeoutError):
    """The controller no longer answers."""
