"""A V4L2 node's controls, on a descriptor of their own.

OpenCV reaches only some of them, hides why one was refused, and never says its range. Controls
belong to the device, not to the descriptor, so they can be set beside whoever streams.
"""

import errno
import os

from drivers.camera import v4l2_ioctl as v4l2
from drivers.camera.device import ControlName
from drivers.errors import ConnectError

_IDS: dict[ControlName, int] = {
    "auto_exposure": 0x009A0901,
    "exposure": 0x009A0902,
    "focus": 0x009A090A,
    "auto_focus": 0x009A090C,
    "auto_white_balance": 0x0098090C,
    "auto_gain": 0x00980912,
    "gain": 0x00980913,
    "power_line": 0x00980918,
    "white_balance": 0x0098091A,
}
_REASONS = {
    errno.EINVAL: "not a value this control takes",
    errno.ERANGE: "out of range",
    errno.EBUSY: "the control is held by another setting or program",
    errno.EACCES: "the control is read-only",
    errno.ENODEV: "the device is gone",
}


class V4l2Controls:
    """The controls of one node; raises ConnectError when the node cannot be opened."""

    def __init__(self, node: str) -> None:
        try:
            self._fd = v4l2.open_node(node)
        except OSError as error:
            raise ConnectError(f"{node}: {error.strerror}") from error

    def read(self, name: ControlName) -> int | None:
        """The present value; None where there is no such control or the device is gone."""
        if v4l2.query_control(self._fd, _IDS[name]) is None:
            return None
        try:
            return v4l2.get_control(self._fd, _IDS[name])
        except OSError:
            return None

    def write(self, name: ControlName, value: int) -> str | None:
        """Set a value; the refusal in words tells the range."""
        info = v4l2.query_control(self._fd, _IDS[name])
        if info is None:
            return "this camera does not have it"
        limits = f"{info.name!r} takes {info.minimum} to {info.maximum} in steps of {info.step}"
        try:
            v4l2.set_control(self._fd, _IDS[name], value)
        except OSError as error:
            reason = _REASONS.get(error.errno or 0, error.strerror or "refused")
            return f"{reason}; {limits}"
        # Written without complaint, yet rounded, clamped or overruled: read back by the caller.
        after = v4l2.query_control(self._fd, _IDS[name])
        if after is not None and after.inactive:
            return f"an automatic overrules it; {limits}"
        return None if info.minimum <= value <= info.maximum else limits

    def close(self) -> None:
        """Let go of the node; harmless when repeated."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
