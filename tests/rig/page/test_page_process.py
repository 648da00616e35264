"""Whatever becomes of the page's process, the run neither waits for it nor changes."""

import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.errors import ConfigError
from drivers.interfaces import ArmState, Frame
from estimator.estimate import Estimate
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config_safety import SafetyConfig
from rig.outcome import LiveStatus
from rig.page.address import PageAddress
from rig.page.live import LivePage
from rig.page.state import state_of, state_of_bytes
from rig.page.watching import Watching
from rig.recorded.setup import RunSetup
from rig.vision import Sighting
from sim_backend.clock import SimulatedClock
from tests.rig.command_line import rig
from tests.rig.log_lines import log_bytes

pytest.importorskip("viser", reason="needs the package viser")

SETUP = RunSetup(
    "sphere", Intrinsics(800.0, 800.0, 319.5, 239.5), np.eye(4), 0.02, "raster", "given", "now"
)


def status(number: int, variance: float | None = None) -> LiveStatus:
    """The run after ``number`` ticks."""
    s = np.array([0.0, 0.0, 15.0])
    frame = Frame(np.full((480, 640), number % 256, np.uint8), 0.01 * number, 0.0, number, "sim")
    return LiveStatus(
        elapsed_s=0.01 * number,
        state="running",
        estimate=Estimate(0.01 * number, s, None, 40.0, variance, 1e-4),
        target_state="tracking",
        frames=number,
        frames_lost=0,
        ticks=number,
        overruns=0,
        speed_m_s=0.05,
        limited_by=("speed",),
        remaining_fraction=0.2,
        late_s=1e-4,
        arm=ArmState(0.01 * number, np.eye(4), np.zeros(6)),
        sighting=Sighting(frame, Measurement(Feature(s, 1e-10 * np.eye(3)))),
    )


@pytest.fixture(scope="module")
def page() -> Iterator[LivePage]:
    """A page that is served, on a clock that the tests move."""
    clock = SimulatedClock()
    page = LivePage(PageAddress(port=None), SafetyConfig(), clock)
    yield page
    page.close()


def test_states_survive_the_journey() -> None:
    sent = state_of(status(7, variance=0.04), status(7).sighting, 33.0, image=3)
    assert state_of_bytes(sent.to_bytes()) == sent
    assert sent.radius_m == 0.025
    assert sent.spread_stated and sent.spread_m == pytest.approx(0.2 * 0.025**2, rel=1e-3)
    assert sent.feature is not None and sent.feature.s.tolist() == [0.0, 0.0, 15.0]
    judged = state_of(status(7), None, 30.0, image=None)
    assert not judged.spread_stated
    # χ has come from 30 to 40 and a fifth of the way is left: 2.5 more.
    assert judged.spread_m == pytest.approx(2.5 * 0.025**2)


def test_images_and_states_are_paced_by_the_wall_whatever_the_runs_clock(page: LivePage) -> None:
    clock = page._clock
    assert isinstance(clock, SimulatedClock)
    page.begin(SETUP)
    posts, images = [], []
    page._board.post = posts.append  # type: ignore[method-assign]
    for number in range(1000):  # a thousand ticks in a second of the wall's time
        page.show(status(number))
        clock.sleep_until(clock.now_s() + 0.001)
        images.append(page._image)
    del page._board.post  # type: ignore[attr-defined]
    assert 25 <= len(posts) <= 32
    assert 13 <= len({image for image in images if image is not None}) <= 16
    assert state_of_bytes(posts[-1]).elapsed_s > 9.0


def test_a_change_of_the_runs_state_is_never_paced_away(page: LivePage) -> None:
    posts: list[bytes] = []
    page._board.post = posts.append  # type: ignore[method-assign]
    for number, state in enumerate(("running", "stopping", "stopped")):
        page.show(replace(status(number), state=state))
    del page._board.post  # type: ignore[attr-defined]
    assert [state_of_bytes(post).state for post in posts][-2:] == ["stopping", "stopped"]


def test_a_page_that_hangs_and_then_dies_is_not_noticed() -> None:
    page = LivePage(PageAddress(), SafetyConfig(), WallClock())
    try:
        page.begin(SETUP)
        for number in (signal.SIGSTOP, signal.SIGKILL):
            os.kill(page.pid, number)
            for tick in range(2000):
                page.show(status(tick))
            for _ in range(1000):  # far more than any buffer between the two holds
                page.begin(SETUP)
        assert not page.stop_requested()
    finally:
        page.close()
    assert not Path(f"/proc/{page.pid}").exists()
    page.close()


@pytest.mark.slow
def test_a_port_that_is_taken_is_refused_when_it_was_asked_for(page: LivePage) -> None:
    taken = int(page.url.rsplit(":", 1)[1])
    with pytest.raises(ConfigError, match="cannot be served"):
        LivePage(PageAddress(port=taken), SafetyConfig(), WallClock())


def test_without_a_page_there_is_nothing_beside_the_view() -> None:
    alone = Watching(None)
    view = object()
    assert alone.url is None
    assert alone.beside(view) is view  # type: ignore[arg-type,comparison-overlap]
    assert alone.or_else(lambda: True)()


def _stalled(page: LivePage) -> None:
    os.kill(page.pid, signal.SIGSTOP)


def _killed(page: LivePage) -> None:
    os.kill(page.pid, signal.SIGKILL)


def _flooded(page: LivePage) -> None:
    """It scribbles into all that is shared but the request to stop."""
    page._board._map[64:] = os.urandom(len(page._board._map) - 64)


@pytest.mark.parametrize(
    "spoil",
    [
        _stalled,
        pytest.param(_killed, marks=pytest.mark.slow),
        pytest.param(_flooded, marks=pytest.mark.slow),
    ],
)
def test_a_run_gives_the_same_numbers_with_a_page_that_is_spoilt(
    spoil, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = ("--duration", "1", "--set", "sim.renderer=raster", "--json", "--no-report")
    alone = rig("run", "--target", "sphere", *short, "--out", str(tmp_path / "alone"))
    begin = LivePage.begin

    def spoilt(page: LivePage, setup: RunSetup) -> None:
        begin(page, setup)
        spoil(page)

    monkeypatch.setattr(LivePage, "begin", spoilt)
    seen = rig("run", "--target", "sphere", *short, "--view", "--out", str(tmp_path / "seen"))
    assert (alone.exit_code, seen.exit_code) == (0, 0), seen.stderr
    assert "live page: http://127.0.0.1:" in seen.stderr
    numbers = [json.loads(outcome.stdout) for outcome in (alone, seen)]
    for values in numbers:
        del values["wall_s"], values["run_dir"]
    assert numbers[0] == numbers[1]
    assert log_bytes(tmp_path / "alone") == log_bytes(tmp_path / "seen")
