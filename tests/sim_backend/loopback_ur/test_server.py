"""The controller on its sockets: real time, faults, rude clients, and the end of its process."""

import socket
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import WallClock
from sim_backend.loopback_ur.process import LoopbackControl, LoopbackProcess
from sim_backend.loopback_ur.server import DASHBOARD_PORT
from tests.drivers.ur.loopback import start_loopback
from tests.sim_backend.loopback_ur.plain_client import PlainClient

pytestmark = pytest.mark.realtime

CLOCK = WallClock()


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback() as process:
        yield process


@pytest.fixture
def client(loopback):
    plain = PlainClient(loopback.host, protocol=1)
    assert plain.outputs("timestamp,actual_q") == ["DOUBLE", "VECTOR6D"]
    assert plain.start()
    yield plain
    plain.close()


def stamps(client, count):
    return np.array([client.data()[0] for _ in range(count)])


def test_data_comes_every_2_ms_of_controller_time_and_in_real_time(client):
    start_s, times = CLOCK.now_s(), stamps(client, 250)
    taken_s = CLOCK.now_s() - start_s
    assert np.allclose(np.diff(times), 0.002, rtol=1e-3)
    assert 0.2 < taken_s < 3.0


def test_while_stalled_nothing_comes_and_then_time_has_gone_on(client, loopback):
    last_s, longest_s = stamps(client, 1)[0], 0.0
    loopback.control.fault("stall", for_s=0.3)
    for _ in range(2000):
        now_s = stamps(client, 1)[0]
        last_s, longest_s = now_s, max(longest_s, now_s - last_s)
        if longest_s > 0.1:
            break
    assert longest_s == pytest.approx(0.302, abs=0.003)


def test_a_drop_closes_and_refuses_for_its_time(client, loopback):
    loopback.control.fault("drop", for_s=0.4)
    with pytest.raises(ConnectionError):
        while True:
            client.receive()
    with pytest.raises(OSError, match=r"hung up|reset"):
        PlainClient(loopback.host)
    CLOCK.sleep_until(CLOCK.now_s() + 0.5)
    PlainClient(loopback.host).close()


def test_the_dashboard_greets_and_answers(loopback):
    with socket.create_connection((loopback.host, DASHBOARD_PORT), 5.0) as connection:
        lines = connection.makefile("rw", encoding="utf-8")
        assert lines.readline() == "Connected: Universal Robots Dashboard Server\n"
        lines.write("robotmode\n")
        lines.flush()
        assert lines.readline() == "Robotmode: RUNNING\n"
        lines.close()


def test_the_truth_is_on_the_hosts_clock(loopback):
    now_s = CLOCK.now_s()
    rows = loopback.control.motion(now_s - 0.1)
    assert rows.shape[1] == 13
    assert np.allclose(np.diff(rows[:, 0]), 0.002)
    assert abs(rows[-1, 0] - now_s) < 1.0


def test_the_pendant_can_change_the_tool_and_nonsense_is_explained(loopback):
    watcher = PlainClient(loopback.host)
    watcher.outputs("tcp_offset")
    assert watcher.start()
    loopback.control.tcp((0.0, 0.01, 0.12, 0.0, 0.0, 0.3))
    while watcher.data()[2] == 0.0:
        pass
    assert watcher.data() == pytest.approx((0.0, 0.01, 0.12, 0.0, 0.0, 0.3))
    loopback.control.tcp((0.0,) * 6)
    watcher.close()
    for nonsense in ((1.0,), (float("nan"),) * 6):
        with pytest.raises(ValueError, match="six numbers"):
            loopback.control.tcp(nonsense)
    with pytest.raises(ValueError, match="from 0 to 1"):
        loopback.control.slider(1.5)


def test_wrong_requests_for_truth_are_explained(loopback):
    with pytest.raises(ValueError, match="unknown fault"):
        loopback.control.fault("explosion")
    other = LoopbackControl(loopback.host)
    other.close()


def test_a_taken_address_is_said_and_two_addresses_run_side_by_side(loopback):
    with pytest.raises(OSError, match="cannot listen"):
        LoopbackProcess(loopback.host)
    with start_loopback() as second:
        assert second.host != loopback.host
