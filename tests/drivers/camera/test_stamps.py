"""Which stamps are believed, and what a frame that repeats one is worth."""

import numpy as np
import pytest

from drivers.camera.device import Grab
from drivers.camera.stamps import Stamp, Stamper

PERIOD_S = 1.0 / 30.0
MAX_AGE_S = 0.5
TRANSFER_S = 0.004
EXPOSURE_S = 0.010
IMAGE = np.zeros((2, 2), np.uint8)


def stamper() -> Stamper:
    return Stamper(PERIOD_S, MAX_AGE_S, TRANSFER_S, assumed_exposure_s=0.002)


def kernel(
    s: Stamper, stamp_s: float | None, returned_s: float, exposure_s: float | None = EXPOSURE_S
) -> Stamp | str:
    grab = Grab(IMAGE, returned_s, stamp_s)
    return s.stamp(grab, "kernel", mid_exposure=False, exposure_s=exposure_s)


def accepted(stamp: Stamp | str) -> Stamp:
    assert isinstance(stamp, Stamp), stamp
    return stamp


def test_a_kernel_stamp_is_shifted_to_mid_exposure() -> None:
    stamp = accepted(kernel(stamper(), 100.0, 100.02))
    assert stamp.source == "kernel"
    assert stamp.t_exposure_mid_s == pytest.approx(100.0 - TRANSFER_S - EXPOSURE_S / 2)
    assert stamp.exposure_s == EXPOSURE_S


def test_a_stamp_of_mid_exposure_is_taken_as_it_is() -> None:
    grab = Grab(IMAGE, 100.02, 100.0, exposure_s=0.003)
    stamp = accepted(stamper().stamp(grab, "stream", mid_exposure=True, exposure_s=None))
    assert (stamp.t_exposure_mid_s, stamp.exposure_s, stamp.source) == (100.0, 0.003, "stream")


def test_without_a_told_exposure_the_assumed_one_counts() -> None:
    assert accepted(kernel(stamper(), 100.0, 100.02, exposure_s=None)).exposure_s == 0.002


@pytest.mark.parametrize(
    "stamp_s",
    [None, 0.0, 100.0 - MAX_AGE_S, 100.0 + 1.01 * PERIOD_S, 1.7e9],
    ids=["none", "zero", "too old", "in the future", "time of day"],
)
def test_a_stamp_never_believed_gives_way_to_the_time_of_arrival(stamp_s: float | None) -> None:
    stamp = accepted(kernel(stamper(), stamp_s, 100.0))
    assert stamp.source == "host"
    assert stamp.t_exposure_mid_s == pytest.approx(100.0 - TRANSFER_S - EXPOSURE_S / 2)


@pytest.mark.parametrize("ahead_s", [0.0, 0.025, 0.99 * PERIOD_S])
def test_up_to_a_period_in_the_future_is_believed(ahead_s: float) -> None:
    assert accepted(kernel(stamper(), 100.0 + ahead_s, 100.0)).source == "kernel"


def test_once_believed_a_repeated_or_old_stamp_is_no_new_exposure() -> None:
    s = stamper()
    accepted(kernel(s, 100.0, 100.02))
    assert "again" in str(kernel(s, 100.0, 100.05))
    assert "earlier" in str(kernel(s, 99.9, 100.08))
    assert "old" in str(kernel(s, 100.1, 100.1 + MAX_AGE_S))
    assert accepted(kernel(s, 101.0, 101.02)).source == "kernel"


def test_once_believed_a_stamp_in_the_future_gives_way_to_the_time_of_arrival() -> None:
    s = stamper()
    accepted(kernel(s, 100.0, 100.02))
    assert accepted(kernel(s, 200.0, 100.06)).source == "host"
    assert accepted(kernel(s, 100.07, 100.09)).source == "kernel"


def test_instants_strictly_increase_whatever_their_source() -> None:
    s = stamper()
    accepted(kernel(s, 100.03, 100.0))  # in the future, but believed
    assert "not newer" in str(kernel(s, None, 100.02))
