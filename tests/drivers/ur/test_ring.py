"""The shared ring: everything once, in order, nothing half overwritten."""

import os

import numpy as np
import pytest

from drivers.ur.ring import CAPACITY, SampleRing, make_ring_file
from tests.drivers.ur.samples import sample_at


@pytest.fixture
def rings():
    file = make_ring_file()
    writer, reader = SampleRing(file), SampleRing(file)
    os.close(file)
    return writer, reader


def test_what_is_published_is_read_exactly(rings):
    writer, reader = rings
    rng = np.random.default_rng(4)
    T = np.eye(4)
    T[:3] = rng.standard_normal((3, 4))
    sent = sample_at(
        12.5,
        T_base_tool=T,
        twist_base=rng.standard_normal(6),
        q_rad=rng.standard_normal(6),
        tcp_offset=rng.standard_normal(6),
        safety_status_bits=1 << 10 | 1 << 2,
        safety_mode=3,
        robot_mode=-1,
        runtime_state=4,
        speed_scaling=0.37,
    )
    writer.publish(sent)
    got = reader.newest()
    for name in type(sent).__slots__:
        assert np.array_equal(getattr(got, name), getattr(sent, name)), name


def test_every_sample_comes_once_and_in_order(rings):
    writer, reader = rings
    assert reader.newest() is None
    following, got = 0, []
    for burst in (0, 3, 1, 0, 7):
        for _ in range(burst):
            writer.publish(sample_at(float(writer.count)))
        fresh, following = reader.since(following)
        got += [sample.t_s for sample in fresh]
    assert got == [float(k) for k in range(11)]


def test_a_reader_that_slept_too_long_gets_the_newest_whole_ones(rings):
    writer, reader = rings
    for k in range(CAPACITY + 500):
        writer.publish(sample_at(float(k)))
    fresh, following = reader.since(0)
    assert [s.t_s for s in fresh] == [float(k) for k in range(564, CAPACITY + 500)]
    assert following == CAPACITY + 500
