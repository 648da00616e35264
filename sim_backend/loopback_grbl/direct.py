"""The emulated controller without a pty: a link whose waiting moves a simulated clock."""

from drivers.errors import OperateError
from sim_backend.clock import SimulatedClock
from sim_backend.loopback_grbl.firmware import Firmware

_TICK_S = 0.001


class DirectLink:
    """Bytes to and from a ``Firmware``; deterministic and faster than real time."""

    def __init__(self, firmware: Firmware, clock: SimulatedClock) -> None:
        self.firmware = firmware
        self._clock = clock
        self._open = True

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, waiting up to ``timeout_s`` for the first byte."""
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            now_s = self._clock.now_s()
            self.firmware.advance_to(now_s)
            data = self.firmware.send(now_s)
            if data or now_s >= deadline_s:
                return data
            self._clock.sleep_until(min(now_s + _TICK_S, deadline_s))

    def write(self, data: bytes) -> None:
        """Send ``data``; raises OperateError after ``close``."""
        if not self._open:
            raise OperateError("the link to the emulated gantry is closed")
        self.firmware.receive(data, self._clock.now_s())

    def close(self) -> None:
        """Refuse further writing."""
        self._open = False
