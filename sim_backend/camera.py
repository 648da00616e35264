"""The simulated camera behind the ``Camera`` interface: frames that arrive late or never."""

import math
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol

import numpy as np

from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.interfaces import Frame
from sim_backend.config import CameraConfig
from sim_backend.exposure import Exposure
from sim_backend.frame_grid import FrameGrid
from sim_backend.lens import Lens, vignetting_gain
from sim_backend.renderer import Renderer
from sim_backend.sensor import expose


class Timeline(Protocol):
    """What moves the camera: known up to the present of a clock."""

    @property
    def clock(self) -> Clock:
        """The clock that frames are exposed on."""
        ...

    def sync(self) -> float:
        """Make the motion known up to the present, or as far as possible; that instant."""
        ...


class SimulatedCamera:
    """A free-running camera: frame n is exposed on a fixed grid and readable some time later.

    A frame becomes readable ``latency_s`` plus jitter after its mid-exposure, but not before
    it is exposed and read out. With a rolling shutter a frame's instant is that of the middle
    row. Rendering happens in a thread of its own: a call of ``read`` that finds a frame exposed
    but not readable yet has it rendered meanwhile, one at a time. What is returned, and when,
    does not depend on that.
    """

    def __init__(
        self,
        config: CameraConfig,
        lens: Lens,
        world: Timeline,
        exposure: Exposure,
        renderer: Renderer,
        seed: int,
    ) -> None:
        self._config = config
        self._world = world
        self._exposure = exposure
        self._renderer = renderer
        self._gain = vignetting_gain(config, lens)
        self._seed = seed
        # Compiles the kernel now rather than in the middle of a run.
        expose(np.zeros((1, 4), np.float32), self._gain[:1, :4], 0.0, 0)
        self._grid = FrameGrid(config, world.clock.now_s(), seed)
        self._last_seq = -1
        self._closed = False
        self._darkroom = ThreadPoolExecutor(1, thread_name_prefix="sim-camera")
        self._ahead: dict[int, Future[Frame]] = {}  # by number, all above the last returned

    def read(self, timeout_s: float) -> Frame | None:
        """The newest readable frame not returned before; see ``drivers.interfaces.Camera``."""
        if self._closed:
            raise OperateError("simulated camera: read after close; build the rig again")
        clock = self._world.clock
        deadline_s = clock.now_s() + timeout_s
        last_look = False
        while True:
            now_s = self._world.sync()
            seq = self._grid.newest_readable(now_s, self._last_seq)
            if seq is not None:
                return self._taken(seq, now_s)
            self._take_ahead(now_s)
            next_s = self._grid.next_readable_s(self._last_seq)
            if last_look:
                return None
            clock.sleep_until(min(next_s, deadline_s))
            # A clock may wake late: look once more unless it is still too early. Motion that is
            # known late must not keep it here.
            if clock.now_s() < next_s:
                return None
            last_look = clock.now_s() >= deadline_s

    def close(self) -> None:
        """Release the renderer; harmless when repeated."""
        self._closed = True
        self._darkroom.shutdown()
        self._renderer.close()

    def _taken(self, seq: int, now_s: float) -> Frame:
        """Frame ``seq``; the next one is rendered while the caller works on it."""
        frame = self._ahead.pop(seq, None) or self._darkroom.submit(self._take, seq)
        self._last_seq = seq
        for overtaken in [number for number in self._ahead if number < seq]:
            self._ahead.pop(overtaken).cancel()
        self._take_ahead(now_s)
        return frame.result()

    def _take_ahead(self, now_s: float) -> None:
        """Begin with the newest frame that is exposed, unless another is being worked on."""
        seq = self._grid.newest_exposed(now_s)
        if seq <= self._last_seq or seq in self._ahead or not self._idle():
            return
        if self._grid.readable_s(seq) < math.inf:
            self._ahead[seq] = self._darkroom.submit(self._take, seq)

    def _idle(self) -> bool:
        return all(frame.done() for frame in self._ahead.values())

    def _take(self, seq: int) -> Frame:
        mid_s = self._grid.mid_s(seq)
        radiance = self._exposure.render(self._renderer, mid_s)
        key = int(np.random.default_rng([self._seed, 2, seq]).integers(1 << 63))
        return Frame(
            image=expose(radiance, self._gain, self._config.noise_grey, key),
            t_exposure_mid_s=mid_s,
            exposure_s=self._config.exposure_s,
            seq=seq,
            stamp_source="sim",
        )
