"""Vision in a child process: the same measurements, and every ending of either side is noticed."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import ConnectError, DeviceTimeoutError, OperateError
from estimator.image.tracker import TargetTracker
from rig.vision.process import ProcessVision
from rig.vision.sighting import Sighting
from tests.rig.vision.discs import (
    CLOCK,
    INTRINSICS,
    PATIENCE_S,
    disc,
    poll_until_error,
    poll_until_seen,
    record,
    watch,
)

pytestmark = pytest.mark.realtime

COUNT = 8


class LeapingClock:
    """The machine's clock, and a leap ahead when a test asks for it."""

    def __init__(self) -> None:
        self.ahead_s = 0.0

    def now_s(self) -> float:
        return CLOCK.now_s() + self.ahead_s

    def sleep_until(self, t_s: float) -> None:
        CLOCK.sleep_until(t_s - self.ahead_s)


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, list[Sighting], OperateError]:
    """When the first poll came, what was seen of a short recording, and how it ended."""
    vision = watch(record(tmp_path_factory.mktemp("short") / "pictures", COUNT), loop=False)
    first_poll_s = CLOCK.now_s()
    seen: list[Sighting] = []
    with contextlib.closing(vision), pytest.raises(OperateError) as ended:
        poll_until_error(vision, seen)
    return first_poll_s, seen, ended.value


@pytest.fixture
def endless(tmp_path: Path) -> Iterator[ProcessVision]:
    vision = watch(record(tmp_path / "pictures", COUNT), loop=True)
    yield vision
    vision.close()


def gone(pid: int) -> bool:
    """Whether a process has ended, reaped or not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_until_gone(pid: int) -> float:
    """Seconds until a process has ended."""
    start_s = CLOCK.now_s()
    while not gone(pid):
        assert CLOCK.now_s() < start_s + PATIENCE_S, f"process {pid} lives on"
        CLOCK.sleep_until(CLOCK.now_s() + 0.005)
    return CLOCK.now_s() - start_s


def test_pictures_arrive_unchanged_and_in_order(watched) -> None:  # type: ignore[no-untyped-def]
    _, seen, _ = watched
    numbers = [sighting.frame.seq for sighting in seen]
    assert numbers
    assert numbers == sorted(set(numbers))
    for sighting in seen:
        np.testing.assert_array_equal(sighting.frame.image, disc(sighting.frame.seq))


def test_the_child_measures_what_a_tracker_here_measures(watched) -> None:  # type: ignore[no-untyped-def]
    _, seen, _ = watched
    tracker = TargetTracker("sphere", INTRINSICS)
    for sighting in seen:
        here, there = tracker.measure(sighting.frame.image).feature, sighting.measurement.feature
        assert here is not None
        assert there is not None
        np.testing.assert_array_equal(there.s, here.s)
        np.testing.assert_array_equal(there.covariance, here.covariance)


def test_nothing_is_measured_before_the_first_poll(watched) -> None:  # type: ignore[no-untyped-def]
    first_poll_s, seen, _ = watched
    assert seen[0].frame.t_exposure_mid_s > first_poll_s


def test_what_the_camera_raises_is_raised_here_in_its_words(watched) -> None:  # type: ignore[no-untyped-def]
    _, _, error = watched
    assert type(error) is OperateError
    assert f"has ended after {COUNT} pictures" in str(error)


def test_a_camera_that_cannot_be_opened_is_a_connect_error(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConnectError, match="holds no image"):
        watch(tmp_path / "empty", loop=True)


def test_a_killed_child_is_an_error_at_once_and_stays_one(endless: ProcessVision) -> None:
    poll_until_seen(endless)
    os.kill(endless.pid, signal.SIGKILL)
    killed_s = CLOCK.now_s()
    with pytest.raises(OperateError, match=r"measures died"):
        poll_until_error(endless, [])
    assert CLOCK.now_s() - killed_s < 1.0  # 0.1 s where nothing else runs
    with pytest.raises(OperateError, match="measures died"):
        endless.poll()


def test_a_child_that_hangs_is_a_timeout_and_can_be_closed(tmp_path: Path) -> None:
    clock = LeapingClock()
    vision = watch(record(tmp_path / "pictures", COUNT), loop=True, clock=clock)
    with contextlib.closing(vision):
        poll_until_seen(vision)
        os.kill(vision.pid, signal.SIGSTOP)
        vision.poll()
        clock.ahead_s = 2.0
        with pytest.raises(DeviceTimeoutError, match="silent"):
            vision.poll()
        os.kill(vision.pid, signal.SIGCONT)
    assert gone(vision.pid)


def test_closing_ends_the_child_and_is_harmless_when_repeated(endless: ProcessVision) -> None:
    poll_until_seen(endless)
    endless.close()
    assert gone(endless.pid)
    endless.close()
    with pytest.raises(OperateError):
        endless.poll()


def test_a_terminals_signals_do_not_reach_the_child(endless: ProcessVision) -> None:
    assert os.getsid(endless.pid) != os.getsid(0)
    os.kill(endless.pid, signal.SIGINT)
    poll_until_seen(endless)


def test_the_child_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    source = record(tmp_path / "pictures", COUNT)
    program = (
        "import sys; from pathlib import Path; from tests.rig.vision import discs\n"
        f"vision = discs.watch(Path({str(source)!r}), loop=True)\n"
        "discs.poll_until_seen(vision); print(vision.pid, flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        assert not gone(child)
        parent.kill()
    assert wait_until_gone(child) < 3.0
