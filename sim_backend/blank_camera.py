"""A camera whose frames come and go as a real one's, without anything in them."""

import numpy as np

from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.interfaces import Frame
from sim_backend.config import CameraConfig
from sim_backend.frame_grid import FrameGrid


class BlankCamera:
    """Keeps the times of the simulated camera, see ``FrameGrid``; every image is the same black."""

    def __init__(self, config: CameraConfig, clock: Clock, seed: int) -> None:
        self._exposure_s = config.exposure_s
        self._clock = clock
        self._grid = FrameGrid(config, clock.now_s(), seed)
        self._image = np.zeros((config.height, config.width), np.uint8)
        self._last_seq = -1
        self._closed = False

    def read(self, timeout_s: float) -> Frame | None:
        """The newest readable frame not returned before; see ``drivers.interfaces.Camera``."""
        if self._closed:
            raise OperateError("simulated camera: read after close; build the rig again")
        deadline_s = self._clock.now_s() + timeout_s
        seq = self._grid.newest_readable(self._clock.now_s(), self._last_seq)
        while seq is None and self._clock.now_s() < deadline_s:
            self._clock.sleep_until(min(self._grid.next_readable_s(self._last_seq), deadline_s))
            seq = self._grid.newest_readable(self._clock.now_s(), self._last_seq)
        if seq is None:
            return None
        self._last_seq = seq
        return Frame(self._image, self._grid.mid_s(seq), self._exposure_s, seq, "sim")

    def close(self) -> None:
        """No more frames; harmless when repeated."""
        self._closed = True
