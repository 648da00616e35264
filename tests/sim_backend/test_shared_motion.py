"""A camera simulated elsewhere sees the arm's motion exactly, and its pictures are the same."""

import os

import numpy as np
import pytest

from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.kinematics import tool_pose
from sim_backend.remote_camera import remote_camera
from sim_backend.rig import SimulatedRig
from sim_backend.shared_motion import CAPACITY, SharedMotion

CONFIG = SimConfig.model_validate({"renderer": "raster"})
TWIST = np.array([-0.05, 0.02, 0.0, 0.0, 0.1, 0.0])


def moving(clock: SimulatedClock, camera_elsewhere: bool) -> SimulatedRig:
    rig = SimulatedRig(CONFIG, "sphere", clock, camera_elsewhere)
    rig.arm.command_twist(TWIST, 60.0)
    return rig


def test_the_reader_has_every_row_once_and_equally_spaced() -> None:
    clock = SimulatedClock()
    rig = moving(clock, camera_elsewhere=True)
    feed = rig.feed()
    motion = SharedMotion(feed.file, clock)
    rows = motion.motion(0.0)
    for k in range(1, 30):
        clock.sleep_until(0.013 * k)
        feed.publish()
        rows = np.vstack([rows, motion.motion(rows[-1, 0] + 0.0005)])
    feed.close()
    np.testing.assert_allclose(np.diff(rows[:, 0]), 0.001, rtol=0, atol=1e-9)
    # Velocities are those of the positions: nothing was mixed up on the way.
    slopes = (rows[2:, 1:7] - rows[:-2, 1:7]) / 0.002
    np.testing.assert_allclose(slopes, rows[1:-1, 7:], atol=1e-3)
    assert np.abs(rows[-1, 1:4] - rows[0, 1:4]).max() > 0.005  # it moved


def test_after_a_long_pause_the_newest_motion_is_there() -> None:
    clock = SimulatedClock()
    rig = moving(clock, camera_elsewhere=True)
    feed = rig.feed()
    motion = SharedMotion(feed.file, clock)
    clock.sleep_until(2e-3 * CAPACITY)
    feed.publish()
    rows = motion.motion(0.0)
    feed.close()
    assert rows[-1, 0] == pytest.approx(clock.now_s(), abs=2e-3)
    assert CAPACITY / 2 < len(rows) < CAPACITY


def test_asking_for_what_is_not_there_yet_takes_a_moment() -> None:
    clock = SimulatedClock()
    feed = moving(clock, camera_elsewhere=True).feed()
    motion = SharedMotion(feed.file, clock)
    feed.close()
    before_s = clock.now_s()
    assert len(motion.motion(1.0)) == 0
    assert clock.now_s() == pytest.approx(before_s + 1e-3)


def test_the_file_has_no_name_and_is_closed_once() -> None:
    feed = moving(SimulatedClock(), camera_elsewhere=True).feed()
    assert os.fstat(feed.file).st_nlink == 0
    feed.close()
    feed.close()


def test_the_remote_camera_takes_the_same_pictures_as_one_on_the_spot() -> None:
    here_clock, there_clock = SimulatedClock(1.0), SimulatedClock(0.995)
    here = moving(here_clock, camera_elsewhere=False)
    rig = SimulatedRig(CONFIG, "sphere", there_clock, camera_elsewhere=True)
    there_clock.sleep_until(1.0)  # the frames of a camera count from when it was made
    rig.arm.command_twist(TWIST, 60.0)
    feed = rig.feed()
    camera = remote_camera(
        CONFIG, "sphere", SharedMotion(feed.file, there_clock), tool_pose, there_clock
    )
    compared = 0
    for k in range(1, 40):
        for clock in (here_clock, there_clock):
            clock.sleep_until(1.0 + 0.01 * k)
        feed.publish()
        expected, got = here.camera.read(0.0), camera.read(0.0)
        if expected is None or got is None:
            assert (expected is None) == (got is None)
            continue
        assert got.seq == expected.seq
        assert got.t_exposure_mid_s == pytest.approx(expected.t_exposure_mid_s, abs=1e-9)
        difference = got.image.astype(int) - expected.image.astype(int)
        assert np.abs(difference).max() <= 1  # a rounding error may tip a pixel over
        assert np.mean(difference != 0) < 1e-3
        compared += 1
    assert compared >= 5
    for device in (camera, here, rig, feed):
        device.close()


def test_a_long_standstill_before_the_first_look_is_skipped_not_computed() -> None:
    clock = SimulatedClock(1.0)
    rig = SimulatedRig(CONFIG, "sphere", clock, camera_elsewhere=True)
    feed = rig.feed()
    motion = SharedMotion(feed.file, clock)
    pose = rig.truth.T_base_camera(1.0)
    clock.sleep_until(100.0)
    rig.skip_rest()
    states = rig.arm.read_states()
    assert 98.9 < states[0].t_s < 99.1
    assert 99.9 < states[-1].t_s <= 100.0
    np.testing.assert_array_equal(rig.truth.T_base_camera(99.5), pose)
    feed.publish()
    rows = motion.motion(2.0)
    assert 98.9 < rows[0, 0] < 99.1
    assert rows[-1, 0] == pytest.approx(100.0, abs=2e-3)
    rig.arm.command_twist(TWIST, 60.0)
    clock.sleep_until(100.5)
    assert np.linalg.norm(rig.truth.T_base_camera(100.5)[:3, 3] - pose[:3, 3]) > 0.005
    feed.close()


def test_a_short_standstill_is_kept() -> None:
    clock = SimulatedClock(1.0)
    rig = SimulatedRig(CONFIG, "sphere", clock, camera_elsewhere=True)
    clock.sleep_until(2.0)
    rig.skip_rest()
    assert rig.arm.read_states()[0].t_s == pytest.approx(1.0)
