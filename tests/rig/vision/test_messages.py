"""What the two processes say to each other survives the way there unchanged."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers import errors
from drivers.errors import ConnectError, DeviceTimeoutError, OperateError, RigError
from drivers.interfaces import Frame
from estimator.image.feature import Feature, Measurement
from rig.vision.messages import (
    MOST_BYTES,
    Failed,
    Idle,
    Images,
    Ready,
    failed,
    job_of,
    message_of,
    seen,
    to_bytes,
)
from rig.vision.sighting import Sighting
from tests.rig.vision.discs import job

IMAGE = np.zeros((3, 4), np.uint8)
NUMBER = st.floats(-1e12, 1e12)


def triple(numbers: list[float]) -> np.ndarray:
    return np.array(numbers)


VECTOR = st.lists(NUMBER, min_size=3, max_size=3).map(triple)
MATRIX = st.lists(NUMBER, min_size=9, max_size=9).map(lambda v: np.array(v).reshape(3, 3))
FEATURE = st.builds(Feature, VECTOR, MATRIX, st.none() | VECTOR)
MEASUREMENT = st.builds(Measurement, FEATURE) | st.builds(
    Measurement, st.none(), st.text(min_size=1, max_size=200)
)


@given(MEASUREMENT, NUMBER, st.integers(0, 1 << 40), st.integers(0, 1 << 40))
def test_a_sighting_arrives_as_it_was(
    measurement: Measurement, t_s: float, seq: int, number: int
) -> None:
    sent = Sighting(Frame(IMAGE, t_s, 0.004, seq, "kernel"), measurement)
    packet = to_bytes(seen(sent, number))
    assert len(packet) < MOST_BYTES
    message = message_of(packet)
    assert message.number == number  # type: ignore[union-attr]
    got = message.sighting(IMAGE)  # type: ignore[union-attr]
    assert (got.frame.t_exposure_mid_s, got.frame.exposure_s) == (t_s, 0.004)
    assert (got.frame.seq, got.frame.stamp_source) == (seq, "kernel")
    assert got.measurement.reason == measurement.reason
    feature, expected = got.measurement.feature, measurement.feature
    assert (feature is None) == (expected is None)
    if feature is not None and expected is not None:
        np.testing.assert_array_equal(feature.s, expected.s)
        np.testing.assert_array_equal(feature.covariance, expected.covariance)
        assert (feature.axis is None) == (expected.axis is None)
        if feature.axis is not None and expected.axis is not None:
            np.testing.assert_array_equal(feature.axis, expected.axis)


@pytest.mark.parametrize(
    "message",
    [Ready(), Images(480, 640), Idle(None), Idle("no frame"), Failed("OperateError", "x")],
)
def test_every_other_message_too(message: object) -> None:
    assert message_of(to_bytes(message)) == message  # type: ignore[arg-type]


def test_a_job_arrives_with_its_whole_configuration(tmp_path: Path) -> None:
    sent = job(tmp_path, loop=True)
    got = job_of(sent.to_bytes())
    assert got.config == sent.config
    assert got.target == sent.target
    np.testing.assert_array_equal(got.intrinsics.distortion, sent.intrinsics.distortion)
    assert got.intrinsics.fx_px == sent.intrinsics.fx_px
    assert got.intrinsics.cy_px == sent.intrinsics.cy_px


@pytest.mark.parametrize(
    "kind",
    [errors.ConfigError, ConnectError, OperateError, DeviceTimeoutError, errors.SafetyError],
)
def test_an_error_keeps_its_kind_and_words(kind: type[RigError]) -> None:
    error = failed(kind("the cable was pulled")).error()
    assert type(error) is kind
    assert str(error) == "the cable was pulled"


def test_a_drivers_own_error_becomes_the_kind_that_everybody_knows() -> None:
    class LensCapError(OperateError):
        pass

    assert type(failed(LensCapError("dark")).error()) is OperateError


def test_endless_words_are_cut_to_what_a_packet_holds() -> None:
    assert len(to_bytes(failed(OperateError("é" * 100_000)))) < MOST_BYTES
