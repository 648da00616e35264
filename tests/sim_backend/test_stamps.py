"""Stamps that are true, and stamps that hide the camera's latency."""

import numpy as np

from tests.sim_backend.helpers import built, camera

LATENCY_S = 0.055


def frames(**settings):
    """Ten frames of a camera at rest."""
    delays = {"latency_s": LATENCY_S, "latency_jitter_s": 0.004}
    rig, clock = built("sphere", camera=camera(**delays, **settings))
    got = []
    while len(got) < 10:
        frame = rig.camera.read(0.1)
        if frame is not None:
            got.append((clock.now_s(), frame))
    rig.close()
    return got


def test_stamps_on_arrival_are_late_by_the_latency_and_free_of_its_jitter():
    true, late = frames(), frames(stamps="arrival")
    for (read_s, a), (same_s, b) in zip(true, late, strict=True):
        assert (a.seq, read_s) == (b.seq, same_s)
        assert b.t_exposure_mid_s == a.t_exposure_mid_s + LATENCY_S
        np.testing.assert_array_equal(a.image, b.image)


def test_what_is_read_and_when_does_not_depend_on_the_stamps():
    # Known to the clock alone: a frame arrives its latency and jitter after its true instant.
    for read_s, frame in frames():
        assert abs(read_s - frame.t_exposure_mid_s - LATENCY_S) < 3 * 0.004 + 1e-9
