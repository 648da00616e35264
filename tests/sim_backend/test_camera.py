"""The simulated camera: instants, delays, drops, blur, rows, noise, lens."""

from itertools import pairwise

import numpy as np
import pytest

from drivers.errors import OperateError
from tests.sim_backend.helpers import (
    FLAT,
    WHITE,
    built,
    camera,
    coverage,
    left_edge,
    up_to_the_middle,
)

PERIOD_S = 1 / 30
UNTILTED = (0.03, -0.02, 0.06, 0.0, 0.0, 0.0)  # a camera that looks along the tool's z


def read_until(rig, clock, end_s, step_s=0.002):
    """Poll the camera; returns [(instant of reading, frame)]."""
    got = []
    while clock.now_s() < end_s:
        clock.sleep_until(clock.now_s() + step_s)
        frame = rig.camera.read(0.0)
        if frame is not None:
            got.append((clock.now_s(), frame))
    return got


def test_frames_are_exposed_on_a_fixed_grid_and_stamped_at_mid_exposure():
    rig, clock = built("sphere", camera=camera(exposure_s=0.006, latency_s=0.01))
    frames = [f for _, f in read_until(rig, clock, 0.5)]
    stamps = np.array([f.t_exposure_mid_s for f in frames])
    np.testing.assert_allclose(np.diff(stamps), PERIOD_S, atol=1e-12)
    assert stamps[0] == pytest.approx(0.003)
    assert [f.seq for f in frames] == list(range(len(frames)))
    frame = frames[0]
    assert frame.image.shape == (480, 640)
    assert frame.image.dtype == np.uint8
    assert (frame.exposure_s, frame.stamp_source) == (0.006, "sim")


@pytest.mark.parametrize("latency_s", [0.02, 0.04, 0.1])
def test_a_frame_becomes_readable_after_the_latency(latency_s):
    rig, clock = built("sphere", camera=camera(latency_s=latency_s))
    for read_s, frame in read_until(rig, clock, 0.5, 0.001)[1:]:
        assert 0 <= read_s - frame.t_exposure_mid_s - latency_s < 0.001 + 1e-9


def test_a_frame_is_never_readable_before_it_is_exposed_and_read_out():
    settings = camera(latency_s=0.0, exposure_s=0.02, row_time_s=2e-5)
    rig, clock = built("sphere", camera=settings)
    read_s, frame = read_until(rig, clock, 0.1, 0.0005)[0]
    assert read_s - frame.t_exposure_mid_s >= (0.02 + 479 * 2e-5) / 2 - 1e-9


def test_latency_jitter_has_the_configured_spread_and_never_turns_the_order_round():
    settings = camera(latency_s=0.05, latency_jitter_s=0.02, width=64, height=48)
    rig, clock = built("sphere", camera=settings)
    got = read_until(rig, clock, 12.0, 0.001)
    delays = np.array([t - f.t_exposure_mid_s for t, f in got])
    seqs = [f.seq for _, f in got]
    assert all(b > a for a, b in pairwise(seqs))
    assert 0.012 < delays.std() < 0.025
    assert delays.mean() == pytest.approx(0.05, abs=0.006)
    assert len(seqs) < seqs[-1] + 1  # some frames were overtaken and are gone


def test_dropped_frames_leave_gaps_in_the_sequence():
    settings = camera(drop_probability=0.3, width=64, height=48)
    rig, clock = built("sphere", camera=settings)
    seqs = [f.seq for _, f in read_until(rig, clock, 12.0, 0.004)]
    missing = 1 - len(seqs) / (seqs[-1] + 1)
    assert missing == pytest.approx(0.3, abs=0.08)


def test_reading_with_a_timeout_waits_for_the_next_frame_and_no_longer():
    rig, clock = built("sphere", camera=camera(latency_s=0.04))
    first = rig.camera.read(1.0)
    assert first.seq == 0
    assert clock.now_s() == pytest.approx(first.t_exposure_mid_s + 0.04)
    assert rig.camera.read(0.0) is None
    assert rig.camera.read(0.01) is None
    assert clock.now_s() == pytest.approx(first.t_exposure_mid_s + 0.05)
    assert rig.camera.read(1.0).seq == 1


def test_only_the_newest_frame_is_returned_after_a_pause():
    rig, clock = built("sphere", camera=camera(latency_s=0.04))
    clock.sleep_until(1.0)
    frame = rig.camera.read(0.0)
    assert 0.96 - PERIOD_S < frame.t_exposure_mid_s <= 0.96
    assert rig.camera.read(0.0) is None


def test_the_picture_shows_the_instant_of_its_stamp_not_of_its_reading():
    rig, clock = built("sphere", **FLAT, camera=camera(latency_s=0.04))
    rig.arm.command_twist(np.array([0.1, 0.05, 0.0, 0.0, 0.0, 0.0]), 5.0)
    frame = None
    while clock.now_s() < 0.6:
        clock.sleep_until(clock.now_s() + 0.01)
        frame = rig.camera.read(0.0) or frame
    covered = coverage(frame.image.astype(float))
    v, u = np.mgrid[0:480, 0:640]
    seen = np.array([(covered * u).sum(), (covered * v).sum()]) / covered.sum()
    fx, fy, cx, cy, _ = rig.intrinsics
    s = rig.truth.s(frame.t_exposure_mid_s)
    # A sphere's outline is centred a little outwards of its centre's projection.
    outwards = s[2] ** 2 / (s[2] ** 2 - 1)
    expected = outwards * s[:2] / s[2] * [fx, fy] + [cx, cy]
    np.testing.assert_allclose(seen, expected, atol=0.05)


def test_motion_blur_is_as_wide_as_the_motion_during_the_exposure():
    edges = {}
    exposure_s = 0.02
    for name, exposure in (("sharp", 0.0), ("blurred", exposure_s)):
        rig, clock = built(
            "cylinder",
            **FLAT,
            cylinder={"direction": (0.0, 1.0, 0.0), "start": {"distance_m": 0.5}},
            camera=camera(exposure_s=exposure),
            T_tool_camera=UNTILTED,
        )
        rig.arm.command_twist(np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]), 5.0)
        clock.sleep_until(0.3)
        edges[name] = coverage(rig.camera.read(0.0).image.astype(float))[240]
    # The variance of the edge's slope grows by width²/12 over that of a sharp pixel edge.
    widths = {}
    for name, row in edges.items():
        slope = np.diff(up_to_the_middle(row))
        x = np.arange(len(slope))
        mean = (slope * x).sum() / slope.sum()
        widths[name] = (slope * (x - mean) ** 2).sum() / slope.sum()
    moved_px = 0.1 * exposure_s / (0.5 - 0.042**2 / 0.5) * 800
    blur_px = np.sqrt(12 * (widths["blurred"] - widths["sharp"]))
    assert blur_px == pytest.approx(moved_px, rel=0.08)


def test_a_rolling_shutter_skews_what_moves_sideways():
    row_time_s = 5e-5
    rig, clock = built(
        "cylinder",
        **FLAT,
        cylinder={"direction": (0.0, 1.0, 0.0), "start": {"distance_m": 0.5}},
        camera=camera(row_time_s=row_time_s),
        T_tool_camera=UNTILTED,
    )
    rig.arm.command_twist(np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]), 5.0)
    clock.sleep_until(0.3)
    frame = rig.camera.read(0.0)
    covered = coverage(frame.image.astype(float))
    expected = []
    for row in (20, 460):
        t_s = frame.t_exposure_mid_s + (row - 239.5) * row_time_s
        expected.append(left_tangent_px(rig.truth.s(t_s), rig.truth.axis(t_s), row))
    assert abs(expected[1] - expected[0]) > 5.0
    seen = [left_edge(covered[row]) for row in (20, 460)]
    np.testing.assert_allclose(seen, expected, atol=0.03)


def left_tangent_px(s, axis, row):
    """Where the left outline of the cylinder (s, axis) crosses a row, exactly."""
    e = s / np.linalg.norm(s)
    sine = 1 / np.linalg.norm(s)
    y = (row - 239.5) / 800
    crossings = []
    for sign in (1, -1):
        n = sine * e + sign * np.sqrt(1 - sine**2) * np.cross(axis, e)
        crossings.append(319.5 - 800 * (n[1] * y + n[2]) / n[0])
    return min(crossings)


@pytest.mark.parametrize("sigma", [0.0, 2.0, 5.0])
def test_read_noise_has_the_configured_size_and_no_bias(sigma):
    rig, clock = built(
        "sphere",
        light=FLAT["light"],
        background={"kind": "plain", "low_grey": 80.0},
        camera=camera(noise_grey=sigma),
    )
    first = rig.camera.read(1.0).image[:150].astype(float)
    clock.sleep_until(0.2)
    second = rig.camera.read(0.0).image[:150].astype(float)
    if sigma == 0.0:
        assert np.all(first == 80)
        return
    assert first.mean() == pytest.approx(80.0, abs=5 * sigma / np.sqrt(first.size))
    assert first.std() == pytest.approx(np.hypot(sigma, np.sqrt(1 / 12)), rel=0.01)
    # Neither pixel to pixel nor frame to frame does it repeat.
    for a, b in [(first, second), (first[:, 1:], first[:, :-1]), (first[1:], first[:-1])]:
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 5 / np.sqrt(first.size)


def test_vignetting_darkens_the_corners_by_the_configured_share():
    rig, _ = built(
        "sphere",
        light=FLAT["light"],
        background={"kind": "plain", "low_grey": 200.0},
        camera=camera(vignetting=0.4),
        sphere={"start": {"distance_m": 0.7}},
    )
    image = rig.camera.read(1.0).image
    assert image[0, 0] == pytest.approx(120, abs=1)
    assert image[240, 320 - 60] > 195
    assert image.max() <= WHITE


def test_after_close_reading_is_refused_and_close_can_be_repeated():
    rig, _ = built("sphere")
    rig.camera.read(1.0)
    rig.close()
    rig.close()
    with pytest.raises(OperateError, match="after close"):
        rig.camera.read(0.0)
