"""From a configuration to open devices: who measures where; failures leave nothing open."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

import rig.build
from drivers.clock import Clock
from drivers.errors import ConfigError, ConnectError
from rig.build import build_rig
from rig.config import RigConfig
from rig.vision.inline import InlineVision
from rig.vision.messages import Job
from rig.vision.process import Feed
from rig.vision.threaded import ThreadedVision

CALIBRATION = {
    "intrinsics": {"fx_px": 800.0, "fy_px": 800.0, "cx_px": 319.5, "cy_px": 239.5},
    "tool_camera_xyz_m": [0.0, 0.0, 0.05],
    "tool_camera_rotvec_rad": [0.0, 0.0, 0.0],
}
REAL = {
    "camera": {"driver": "opencv", "source": "http://127.0.0.1:1/stream.mjpg"},
    "arm": {"driver": "ur", "host": "127.0.0.1"},
    "calibration": CALIBRATION,
}


@dataclass
class Recorded:
    """A device that only notes what became of it; it may refuse to open."""

    name: str
    events: list[str]

    def close(self) -> None:
        self.events.append(f"{self.name} closed")


@pytest.fixture
def events(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Real devices replaced by notes of their being opened and closed."""
    notes: list[str] = []

    def opener(name: str) -> Callable[[object, Clock], Recorded]:
        def open_device(config: object, clock: Clock) -> Recorded:
            notes.append(f"{name} opened")
            return Recorded(name, notes)

        return open_device

    def process(job: Job, clock: Clock, feed: Feed | None = None) -> Recorded:
        notes.append("vision process opened" + (" with a feed" if feed is not None else ""))
        if feed is not None:
            feed.close()
        return Recorded("vision process", notes)

    monkeypatch.setattr(rig.build, "open_camera", opener("camera"))
    monkeypatch.setattr(rig.build, "open_arm", opener("arm"))
    monkeypatch.setattr(rig.build, "ProcessVision", process)
    return notes


def config(tree: dict[str, object], **run: object) -> RigConfig:
    return RigConfig.model_validate({**tree, "sim": {"renderer": "raster"}, "run": run})


def test_a_real_camera_is_measured_in_a_process_of_its_own(events: list[str]) -> None:
    with build_rig(config(REAL), "sphere", realtime=False) as built:
        assert built.realtime
    assert events == [
        "vision process opened",
        "arm opened",
        "arm closed",
        "vision process closed",
    ]


def test_or_in_a_thread_where_that_is_asked_for(events: list[str]) -> None:
    with build_rig(config(REAL, vision="thread"), "sphere", realtime=False) as built:
        assert isinstance(built.vision, ThreadedVision)
    assert events == ["camera opened", "arm opened", "arm closed", "camera closed"]


@pytest.mark.parametrize("vision", ["auto", "thread", "process"])
def test_on_simulated_time_everything_happens_in_the_loops_own_thread(
    events: list[str], vision: str
) -> None:
    with build_rig(config({}, vision=vision), "sphere", realtime=False) as built:
        assert isinstance(built.vision, InlineVision)
        assert not built.realtime
    assert events == []


def test_a_simulated_rig_on_the_wall_clock_renders_in_the_vision_process(
    events: list[str],
) -> None:
    with build_rig(config({}), "sphere", realtime=True) as built:
        assert built.realtime
        assert built.truth is not None
    assert events == ["vision process opened with a feed", "vision process closed"]


def test_or_here_where_a_thread_is_asked_for(events: list[str]) -> None:
    with build_rig(config({}, vision="thread"), "sphere", realtime=True) as built:
        assert isinstance(built.vision, ThreadedVision)
    assert events == []


def test_vision_is_closed_when_the_arm_cannot_be_opened(
    events: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(config: object, clock: Clock) -> None:
        raise ConnectError("no arm there")

    monkeypatch.setattr(rig.build, "open_arm", refuse)
    with pytest.raises(ConnectError, match="no arm there"):
        build_rig(config(REAL), "sphere", realtime=False)
    assert events == ["vision process opened", "vision process closed"]


def test_a_real_rig_without_a_calibration_opens_nothing(events: list[str]) -> None:
    with pytest.raises(ConfigError, match=r"calibration\.intrinsics"):
        build_rig(config({**REAL, "calibration": {}}), "sphere", realtime=False)
    assert events == []


def test_a_simulated_camera_on_a_real_arm_is_refused(events: list[str]) -> None:
    with pytest.raises(ConfigError, match="do not go together"):
        build_rig(config({"arm": REAL["arm"]}), "sphere", realtime=False)
    assert events == []
