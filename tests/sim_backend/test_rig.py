"""The assembled rig: determinism, truth, defaults, threads."""

import threading
from itertools import pairwise

import numpy as np
import pytest

from drivers.clock import WallClock
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.rig import SimulatedRig
from tests.sim_backend.helpers import built

TWIST = np.array([-0.04, 0.01, 0.02, 0.05, -0.18, 0.02])


def run(seed=1, extra_looks=False, **settings):
    """Half a second of motion: all frames and states."""
    rig, clock = built("sphere", seed=seed, **settings)
    frames, states = [], []
    for k in range(50):
        if extra_looks:
            for j in range(1, 4):
                clock.sleep_until((k + 0.25 * j) * 0.01)
                rig.truth.s(clock.now_s())
        clock.sleep_until((k + 1) * 0.01)
        rig.arm.command_twist(TWIST, 0.05)
        states += rig.arm.read_states()
        frame = rig.camera.read(0.0)
        if frame is not None:
            frames.append(frame)
    return frames, states


def same(a, b):
    """Whether two runs delivered the same bytes."""
    frames = all(
        np.array_equal(f.image, g.image)
        and (f.seq, f.t_exposure_mid_s) == (g.seq, g.t_exposure_mid_s)
        for f, g in zip(a[0], b[0], strict=True)
    )
    states = all(
        s.t_s == r.t_s
        and np.array_equal(s.T_base_tool, r.T_base_tool)
        and np.array_equal(s.twist_tool, r.twist_tool)
        for s, r in zip(a[1], b[1], strict=True)
    )
    return frames and states


def test_the_same_seed_and_calls_give_the_same_bytes():
    settings = {"camera": {"drop_probability": 0.1, "latency_jitter_s": 0.01}}
    first = run(**settings)
    assert len(first[0]) > 8
    assert same(first, run(**settings))


def test_looking_more_often_changes_nothing():
    assert same(run(), run(extra_looks=True))


def test_another_seed_gives_other_noise():
    (a, _), (b, _) = run(seed=1), run(seed=2)
    assert not np.array_equal(a[0].image, b[0].image)


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_the_truth_obeys_the_papers_kinematics(target):
    rig, clock = built(target)
    rig.arm.command_twist(TWIST, 5.0)
    clock.sleep_until(0.5)
    t, h = 0.4, 1e-4
    s_dot = (rig.truth.s(t + h) - rig.truth.s(t - h)) / (2 * h)
    v, w = np.split(rig.truth.twist_camera(t), 2)
    a = rig.truth.axis(t)
    across = np.eye(3) if a is None else np.eye(3) - np.outer(a, a)
    expected = -across @ v / rig.truth.radius_m + np.cross(rig.truth.s(t), w)
    np.testing.assert_allclose(s_dot, expected, atol=2e-3)
    if a is not None:
        assert a @ rig.truth.s(t) == pytest.approx(0.0, abs=1e-9)
        a_dot = (rig.truth.axis(t + h) - rig.truth.axis(t - h)) / (2 * h)
        np.testing.assert_allclose(a_dot, np.cross(a, w), atol=1e-5)


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_the_start_is_the_configured_view(target):
    config = SimConfig(renderer="raster")
    rig = SimulatedRig(config, target, SimulatedClock())
    start = getattr(config, target).start
    T = rig.truth.T_base_camera(0.0)
    position = np.array(getattr(config, target).position_m)
    seen = T[:3, :3].T @ (position - T[:3, 3])
    assert np.linalg.norm(seen) == pytest.approx(start.distance_m)
    np.testing.assert_allclose(800 * seen[:2] / seen[2], start.offset_px, atol=1e-6)


def test_the_default_cylinder_lies_at_sixty_degrees_in_the_image():
    rig, _ = built("cylinder")
    axis = rig.truth.axis(0.0)
    np.testing.assert_allclose(axis * np.sign(axis[0]), [0.5, np.sqrt(0.75), 0.0], atol=1e-9)


def test_truth_beyond_the_present_is_refused():
    rig, clock = built("sphere")
    clock.sleep_until(0.5)
    with pytest.raises(ValueError, match="outside the recorded motion"):
        rig.truth.s(0.6)
    with pytest.raises(ValueError, match="outside the recorded motion"):
        rig.truth.s(-0.1)


def test_camera_and_arm_may_be_used_from_two_threads_on_the_wall_clock():
    clock = WallClock()
    rig = SimulatedRig(SimConfig(renderer="raster"), "sphere", clock)
    frames = []

    def watch():
        for _ in range(6):
            frame = rig.camera.read(5.0)
            if frame is not None:
                frames.append(frame)

    thread = threading.Thread(target=watch)
    thread.start()
    states = []
    while thread.is_alive():
        rig.arm.command_twist(TWIST, 0.05)
        states += rig.arm.read_states()
        thread.join(0.01)
    rig.close()
    assert len(frames) == 6
    assert all(b.seq > a.seq for a, b in pairwise(frames))
    np.testing.assert_allclose(np.diff([s.t_s for s in states]), 0.002, atol=1e-6)
