"""Latency and cost of a camera over MJPEG: the stream read directly, and through FFmpeg.

Each picture carries its number as black and white bars, so that its age is known even where
the stamps are not. Run with ``python -m benchmarks.bench_camera``.
"""

from collections.abc import Callable

import cv2
import numpy as np

from drivers.camera.mjpeg_device import MjpegDevice
from drivers.camera.open import open_camera
from drivers.camera.settings import CameraSettings
from drivers.clock import Clock, WallClock, thread_cpu_time_s
from drivers.interfaces import Frame, GreyImage
from sim_backend.loopback_camera.publisher import encode_part
from sim_backend.loopback_camera.server import MjpegServer

RATE_HZ = 30.0
FRAMES = 300
BITS = 16
WIDTH, HEIGHT = 640, 480


class BarCamera:
    """Delivers numbered pictures at 30 Hz on the wall clock, each at its instant."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.start_s = clock.now_s()
        self._seq = -1
        self._noise = np.random.default_rng(0).integers(0, 12, (HEIGHT, WIDTH)).astype(np.uint8)

    def read(self, timeout_s: float) -> Frame | None:
        """The next numbered picture."""
        due = int((self._clock.now_s() - self.start_s) * RATE_HZ)
        self._seq = max(self._seq + 1, due)
        self._clock.sleep_until(self.at_s(self._seq))
        image = self._noise.copy()
        for bit in range(BITS):
            if self._seq >> bit & 1:
                image[:, bit * 40 : (bit + 1) * 40] += 220
        return Frame(image, self.at_s(self._seq), 0.004, self._seq, "sim")

    def at_s(self, seq: int) -> float:
        """When picture ``seq`` was taken."""
        return self.start_s + seq / RATE_HZ


def number_of(image: GreyImage) -> int:
    """The number shown by the bars."""
    return sum(int(image[HEIGHT // 2, bit * 40 + 20] > 128) << bit for bit in range(BITS))


def ages_ms(read: Callable[[], GreyImage], camera: BarCamera, clock: Clock) -> list[float]:
    """How old each of ``FRAMES`` pictures is when ``read`` returns it."""
    out = []
    for _ in range(FRAMES):
        image = read()
        out.append(1e3 * (clock.now_s() - camera.at_s(number_of(image))))
    return out


def show(name: str, ages: list[float]) -> None:
    """Median and tail of a list of ages."""
    median, p99 = np.percentile(ages, [50, 99])
    print(f"{name}: age when returned, median {median:.2f} ms, p99 {p99:.2f} ms")


def main() -> None:
    """Measure and print."""
    clock = WallClock()
    camera = BarCamera(clock)
    with MjpegServer(camera.read) as server:
        before_s = clock.now_s()
        capture = cv2.VideoCapture(server.url, cv2.CAP_FFMPEG)
        print(f"FFmpeg: open takes {clock.now_s() - before_s:.2f} s")

        def read_ffmpeg() -> GreyImage:
            return np.asarray(capture.read()[1][..., 0], dtype=np.uint8)

        show("FFmpeg", ages_ms(read_ffmpeg, camera, clock))
        capture.release()
    camera = BarCamera(clock)
    with MjpegServer(camera.read) as server:
        settings = CameraSettings(source=server.url, rate_hz=RATE_HZ)
        before_s = clock.now_s()
        direct = open_camera(settings, clock)
        print(f"direct: open takes {clock.now_s() - before_s:.2f} s, 2 s of it the rate check")

        def read() -> GreyImage:
            frame = direct.read(1.0)
            if frame is None:
                raise RuntimeError("no frame within a second")
            return frame.image

        show("direct", ages_ms(read, camera, clock))
        print(f"direct: {direct.health()}")
        direct.close()
    camera = BarCamera(clock)
    with MjpegServer(camera.read) as server:
        device = MjpegDevice(server.url, clock, 1.0)
        before_s = thread_cpu_time_s()
        for _ in range(100):
            device.grab()
        print(f"direct: {10 * (thread_cpu_time_s() - before_s):.2f} ms of CPU per picture read")
        device.release()
    frame = camera.read(0.0)
    if frame is not None:
        before_s = thread_cpu_time_s()
        for _ in range(100):
            encode_part(frame, 95)
        print(f"server: {10 * (thread_cpu_time_s() - before_s):.2f} ms of CPU per picture encoded")


if __name__ == "__main__":
    main()
