"""Frames are rendered while the caller is busy, each once, and look the same as without that."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from drivers.interfaces import Frame
from sim_backend.exposure import Exposure
from tests.sim_backend.helpers import built, camera

SMALL = {"width": 64, "height": 48}


def read_at(step_s: float, end_s: float, **settings: object) -> list[Frame]:
    """What polling every ``step_s`` returns."""
    rig, clock = built("sphere", camera=camera(**SMALL, **settings))
    rig.arm.command_twist(np.array([0.02, 0.0, 0.0, 0.0, 0.0, 0.3]), 10.0)
    frames = []
    while clock.now_s() < end_s:
        clock.sleep_until(clock.now_s() + step_s)
        frame = rig.camera.read(0.0)
        if frame is not None:
            frames.append(frame)
    rig.close()
    return frames


@pytest.fixture
def renderings(monkeypatch: pytest.MonkeyPatch) -> Counter[float]:
    """How often each exposure was rendered, by its instant."""
    counts: Counter[float] = Counter()
    render = Exposure.render

    def counted(self, renderer, mid_s):  # type: ignore[no-untyped-def]
        counts[mid_s] += 1
        return render(self, renderer, mid_s)

    monkeypatch.setattr(Exposure, "render", counted)
    return counts


# With a latency of more than a period the next frame is exposed before this one can be read.
@pytest.mark.parametrize("latency_s", [0.0, 0.02, 0.04, 0.1])
def test_no_frame_is_rendered_twice(latency_s: float, renderings: Counter[float]) -> None:
    frames = read_at(0.01, 1.0, latency_s=latency_s, latency_jitter_s=0.1 * latency_s)
    assert len(frames) > 20
    assert set(renderings.values()) == {1}
    assert {frame.t_exposure_mid_s for frame in frames} <= set(renderings)
    assert len(renderings) <= len(frames) + 4  # what was begun and is still under way


def test_a_late_caller_gets_the_newest_frame_and_the_overtaken_ones_are_dropped(
    renderings: Counter[float],
) -> None:
    frames = read_at(0.1, 1.0, latency_s=0.04)
    assert len(frames) > 8
    assert {b.seq - a.seq for a, b in pairwise(frames)} == {3}
    assert max(renderings.values()) == 1


def test_what_a_frame_shows_does_not_depend_on_when_it_was_rendered() -> None:
    settings = {"latency_s": 0.04, "noise_grey": 2.0, "exposure_s": 0.01}
    often, seldom = (read_at(step_s, 0.6, **settings) for step_s in (0.002, 0.05))
    by_seq = {frame.seq: frame for frame in often}
    assert len(seldom) > 5
    for frame in seldom:
        np.testing.assert_array_equal(frame.image, by_seq[frame.seq].image)
