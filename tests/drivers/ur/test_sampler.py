"""From packets to samples: whatever the network did, their instants increase."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur.receiver import Sampler
from drivers.ur.rtde_codec import Value

PERIOD_S = 0.002


def packet(controller_s: float) -> dict[str, Value]:
    return {
        "timestamp": controller_s,
        "actual_TCP_pose": (0.4, 0.0, 0.5, 0.0, 3.0, 0.0),
        "actual_TCP_speed": (0.0,) * 6,
        "actual_q": (0.0,) * 6,
        "safety_status_bits": 1,
        "safety_mode": 1,
        "robot_mode": 7,
        "runtime_state": 2,
        "speed_scaling": 1.0,
    }


def packets(first: int, count: int) -> list[dict[str, Value]]:
    return [packet(1000.0 + PERIOD_S * k) for k in range(first, first + count)]


def test_what_a_busy_machine_reads_at_once_is_stamped_one_after_the_other() -> None:
    samples = Sampler().samples(packets(0, 8), 50.0)
    stamps_s = np.array([sample.t_s for sample in samples])
    assert stamps_s == pytest.approx(50.0 - PERIOD_S * np.arange(7, -1, -1), abs=1e-9)


def test_a_sample_that_seems_older_than_one_given_out_is_left_out() -> None:
    sampler = Sampler()
    late = sampler.samples(packets(0, 3), 50.010)  # the read was held up by 6 ms
    on_time = sampler.samples(packets(3, 4), 50.0121)
    assert late[-1].t_s == pytest.approx(50.010, abs=1e-9)
    assert [sample.t_s for sample in on_time] == pytest.approx([50.0101, 50.0121], abs=1e-9)


def test_a_packet_that_comes_twice_is_one_sample() -> None:
    sampler = Sampler()
    assert len(sampler.samples(packets(0, 2), 50.0)) == 2
    assert sampler.samples(packets(1, 1), 50.001) == []


@given(
    bursts=st.lists(
        st.tuples(st.integers(0, 12), st.floats(0.0, 0.05), st.booleans()), min_size=1, max_size=25
    )
)
def test_instants_increase_and_never_lie_ahead_of_the_arrival(
    bursts: list[tuple[int, float, bool]],
) -> None:
    sampler, k, arrival_s, stamps_s = Sampler(), 0, 50.0, []
    for count, wait_s, restarted in bursts:
        k = 0 if restarted else k
        arrival_s += wait_s
        samples = sampler.samples(packets(k, count), arrival_s)
        k += count
        assert all(sample.t_s <= arrival_s for sample in samples)
        stamps_s += [sample.t_s for sample in samples]
    assert all(later > earlier for earlier, later in pairwise(stamps_s))
