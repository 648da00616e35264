"""The grab loop on simulated time: opening, rate, stamps and numbers."""

import numpy as np
import pytest

from drivers.camera.device import Mode
from drivers.camera.settings import CameraControls
from drivers.errors import ConnectError
from tests.drivers.camera.grabber_bench import Bench
from tests.drivers.camera.scripted import PERIOD_S, noise


def test_opening_measures_the_rate_for_the_time_configured() -> None:
    bench = Bench(rate_check_s=2.0)
    opened_s = bench.open()
    assert opened_s - 1000.0 == pytest.approx(2.0, abs=5 * PERIOD_S)
    health = bench.grabber.health()
    assert health.state == "streaming"
    assert health.measured_rate_hz == pytest.approx(30.0, rel=1e-6)


def test_frames_are_numbered_stamped_and_complete() -> None:
    bench = Bench(transfer_s=0.002, controls=CameraControls(exposure_ms=4.0))
    bench.script.controls = {"exposure": 40}
    start_s = bench.open()
    bench.run_until(start_s + 1.0)
    seqs = [frame.seq for _, frame in bench.delivered]
    assert np.all(np.diff(seqs) == 1)
    assert len(seqs) >= 29
    for _, frame in bench.delivered:
        n = round((frame.t_exposure_mid_s + 0.002 + 0.002) / PERIOD_S)
        assert frame.t_exposure_mid_s == pytest.approx(n * PERIOD_S - 0.004, abs=1e-9)
        assert np.array_equal(frame.image, noise(n))
        assert (frame.stamp_source, frame.exposure_s) == ("kernel", 0.004)


@pytest.mark.parametrize(("period_s", "fits"), [(1 / 28.6, True), (1 / 28.4, False)])
def test_a_rate_beyond_five_percent_is_an_error_with_both_numbers(
    period_s: float, fits: bool
) -> None:
    bench = Bench()
    bench.script.period_s = period_s
    if fits:
        bench.open()
        return
    with pytest.raises(ConnectError, match=r"30 fps requested, 28\.40 measured over 2 s"):
        bench.open()
    assert bench.script.released == bench.script.opened == 1


def test_an_optional_rate_is_a_warning() -> None:
    bench = Bench(optional=("rate",))
    bench.script.period_s = 1 / 20.0
    bench.open()
    assert any("20.00 measured" in warning for warning in bench.grabber.health().warnings)


def test_a_camera_that_never_delivers_cannot_be_opened() -> None:
    bench = Bench()
    bench.script.stalled = lambda t_s: True
    with pytest.raises(ConnectError, match="stalled"):
        bench.open()
    assert bench.script.released == 1


def test_a_device_that_fails_its_set_up_is_released() -> None:
    bench = Bench(width=640, height=480)
    with pytest.raises(ConnectError, match="640x480"):
        bench.open()
    assert bench.script.released == bench.script.opened == 1


def test_dropped_exposures_are_counted_by_the_sources_numbers() -> None:
    bench = Bench()
    bench.script.sequence = lambda n: n
    start_s = bench.open()
    lost = {round(start_s / PERIOD_S) + k for k in (5, 6, 20)}
    bench.script.dropped = lambda n: n in lost
    bench.run_until(start_s + 1.0)
    assert bench.grabber.health().dropped == 3


def test_closing_releases_the_device_once() -> None:
    bench = Bench()
    bench.open()
    bench.grabber.close()
    bench.grabber.close()
    bench.grabber.step()
    assert bench.script.released == 1
    assert bench.grabber.health().state == "closed"


def test_the_mode_in_the_health_is_what_the_device_does() -> None:
    bench = Bench()
    bench.script.mode = Mode(16, 12, 30.0, "GREY")
    bench.open()
    assert bench.grabber.health().mode == bench.script.mode
