"""A grabber with a scripted device on simulated time."""

from drivers.camera.grabber import Grabber
from drivers.camera.newest import NewestFrame
from drivers.camera.settings import CameraSettings
from drivers.interfaces import Frame
from sim_backend.clock import SimulatedClock
from tests.drivers.camera.scripted import Script


class Bench:
    """A grabber, its script, and every frame it delivered with the instant it did."""

    def __init__(self, **settings: object) -> None:
        self.clock = SimulatedClock(1000.0)
        self.script = Script(self.clock)
        given = {"rate_hz": 30.0, "select_timeout_s": 1, **settings}
        self.settings = CameraSettings(source=0, **given)  # type: ignore[arg-type]
        self.newest = NewestFrame(self.clock, self.settings.max_age_s)
        self.grabber = Grabber(self.script.open, self.settings, self.clock, self.newest, "test")
        self.delivered: list[tuple[float, Frame]] = []

    def open(self) -> float:
        """Open; returns the instant at which it was open."""
        self.grabber.open()
        return self.clock.now_s()

    def run_until(self, t_s: float) -> None:
        while self.clock.now_s() < t_s and self.grabber.failed is None:
            self.grabber.step()
            frame = self.newest.take()
            if frame is not None:
                self.delivered.append((self.clock.now_s(), frame))

    def noticed_after_s(self, at_s: float, limit_s: float = 5.0) -> float:
        """How long after ``at_s`` the grabber gave the device up or complained."""
        while self.grabber.health().problem is None:
            assert self.clock.now_s() < at_s + limit_s, "never noticed"
            self.grabber.step()
        return self.clock.now_s() - at_s
