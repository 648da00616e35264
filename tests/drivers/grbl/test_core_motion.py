"""Following and measuring: the driver's core against the emulated controller."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.grbl.selftest import measure_delay
from drivers.grbl.session import Session
from estimator.displacement import displacement
from estimator.twist_history import TwistHistory
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import Gantry

FloatArray = NDArray[np.float64]

UART = Machine(clock_rate=1.0)
USB = Machine(clock_rate=1.0, baud=1_000_000)
THREE = Machine(clock_rate=1.0, axes=3)
PLAIN = Machine(clock_rate=1.0, axes=3, flavour="Grbl")
ALL = pytest.mark.parametrize(
    "machine", [UART, USB, THREE, PLAIN], ids=lambda m: f"{m.flavour}-{m.axes}-{m.baud}"
)

X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
MIXED = np.array([0.03, -0.01, 0.02, 0.10, -0.15, 0.20])


@ALL
def test_it_follows_a_velocity_within_a_percent(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.04 * X, 1.0)
    begun_s, q = gantry.clock.now_s(), gantry.q()
    gantry.drive(0.04 * X, 2.0)
    assert (gantry.q() - q)[0] / (gantry.clock.now_s() - begun_s) == pytest.approx(0.04, rel=0.01)


@pytest.mark.parametrize("machine", [UART, USB])
def test_it_follows_a_tool_twist_with_all_axes(machine: Machine) -> None:
    gantry = Gantry(machine, np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.4]))
    gantry.drive(MIXED, 1.0)
    gantry.drive(MIXED, 1.0)
    _, q, qd = gantry.motion(gantry.clock.now_s() - 1.0)
    twists = np.array([gantry.kinematics.tool_twist(*pair) for pair in zip(q, qd, strict=True)])
    # Whole steps make single blocks ragged; the mean does not drift.
    assert twists.mean(axis=0) == pytest.approx(MIXED, abs=0.002)


@pytest.mark.parametrize(("machine", "most_s"), [(UART, 0.175), (USB, 0.16), (THREE, 0.17)])
def test_a_step_in_speed_arrives_after_the_delay_of_the_facts(
    machine: Machine, most_s: float
) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.02 * X, 1.0)
    begun_s = gantry.clock.now_s()
    gantry.drive(0.04 * X, 0.5)
    t, _, qd = gantry.motion(begun_s)
    delay_s = float(t[np.flatnonzero(qd[:, 0] > 0.03)[0]] - begun_s)
    assert 0.08 < delay_s < most_s
    # What the arm claims about itself is no more than 20 ms better than the truth.
    assert gantry.session.timing.command_delay_s > delay_s - 0.02


@ALL
def test_starting_is_smooth(machine: Machine) -> None:
    gantry = Gantry(machine)
    begun_s = gantry.clock.now_s()
    gantry.drive(0.02 * X, 0.6)
    _, _, qd = gantry.motion(begun_s)
    moving = qd[np.flatnonzero(qd[:, 0])[0] :, 0]
    assert moving[25:].min() > 0.019  # 20 ms after it began it never slows down again


@ALL
def test_measured_states_are_the_true_motion_at_their_own_instant(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.03 * X, 0.5)
    gantry.states.clear()
    gantry.drive(0.03 * X, 1.0)
    speeds = np.array([state.twist_tool[0] for state in gantry.states])
    assert speeds.mean() == pytest.approx(0.03, rel=0.005)
    assert speeds.std() < 0.001
    for state in gantry.states[::5]:
        true = gantry.kinematics.tool_pose(gantry.firmware.history.at(state.t_s)[0][: machine.axes])
        assert state.T_base_tool == pytest.approx(true, abs=1e-4)
    assert np.all(np.diff([state.t_s for state in gantry.states]) > 0.0)


@ALL
def test_the_stated_uncertainty_covers_the_measured_one(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.03 * X, 0.5)
    gantry.states.clear()
    gantry.drive(0.03 * X, 2.0)
    error = np.std([state.twist_tool[0] for state in gantry.states])
    stated = np.sqrt(np.median([state.twist_covariance[0, 0] for state in gantry.states]))
    assert error < gantry.session.timing.velocity_std_m_s(0.03) < 0.002
    assert error < 1.5 * stated < 0.003
    assert gantry.session.timing.velocity_std_m_s(0.03, 1.0) > 0.015  # what the mean hides


@ALL
def test_each_state_states_an_uncertainty_that_covers_its_error_also_while_accelerating(
    machine: Machine,
) -> None:
    gantry = Gantry(machine)
    turned = machine.axes == 6
    twist = np.array([0.03, -0.02, 0.01, 0.1 * turned, 0.0, -0.2 * turned])
    for k in range(6):
        gantry.drive(twist if k % 2 else -twist, 0.5)
    scores = []
    for state in gantry.states[5:]:
        q, qd = (part[: machine.axes] for part in gantry.firmware.history.at(state.t_s))
        true = gantry.kinematics.tool_twist(q, qd)
        std = np.sqrt(np.diag(state.twist_covariance))
        known = std > 0.0
        scores += list(np.abs(state.twist_tool - true)[known] / std[known])
        assert np.abs(state.twist_tool - true)[~known] == pytest.approx(0.0, abs=1e-9)
    assert np.percentile(scores, 68.0) < 1.5
    assert np.percentile(scores, 95.0) < 3.0
    assert all(0.0 < state.t_std_s < 0.01 for state in gantry.states)


@pytest.mark.parametrize("machine", [UART, USB])
def test_the_stated_spectrum_tells_how_far_integrated_twists_lose_the_way(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(np.abs(MIXED), 0.5)
    gantry.states.clear()
    for k in range(60):
        turned = np.array([np.cos(0.05 * k), np.sin(0.05 * k), 0.3, 1.0, np.cos(0.1 * k), 1.0])
        gantry.drive(np.abs(MIXED) * turned, 0.05)
    history = TwistHistory()
    twists = [state.twist_tool for state in gantry.states]
    history.extend([state.t_s for state in gantry.states], twists)
    spectrum = np.mean([state.twist_spectrum for state in gantry.states], axis=0)

    def pose(t_s: float) -> FloatArray:
        return gantry.kinematics.tool_pose(gantry.firmware.history.at(t_s)[0][: machine.axes])

    def off(t_s: float, duration_s: float) -> FloatArray:
        window = history.window(t_s, t_s + duration_s)
        R, d = displacement(window.times_s, window.twists_camera)
        T, after = pose(t_s), pose(t_s + duration_s)
        moved = after[:3, :3].T @ (after[:3, 3] - T[:3, 3])
        turned = R @ T[:3, :3].T @ after[:3, :3]
        return np.concatenate([d - moved, Rotation.from_matrix(turned).as_rotvec()])

    for duration_s, least, most in ((1.0 / 30.0, 0.4, 1.7), (1.0, 0.1, 1.0)):
        starts = np.arange(history.start_s + 0.1, history.end_s - duration_s - 0.1, 0.021)
        errors = np.array([off(t_s, duration_s) for t_s in starts])
        scores = errors.std(axis=0) / np.sqrt(duration_s * np.diag(spectrum))
        assert np.all((least < scores) & (scores < most)), scores


def test_states_come_at_fifty_hertz_and_none_is_older_than_the_timing_says() -> None:
    gantry = Gantry(UART)
    gantry.run(5.0)
    gantry.states.clear()
    ages = []
    for _ in range(1000):
        gantry.run(0.005)
        ages.append(gantry.clock.now_s() - gantry.states[-1].t_s if gantry.states else 0.0)
    assert len(gantry.states) / 5.0 > 48.0
    timing = gantry.session.timing
    assert np.median(ages) < timing.state_age_s + 0.015
    assert np.percentile(ages, 99.5) < timing.state_age_max_s + 0.005


@ALL
def test_no_backlog_ever_builds_up(machine: Machine) -> None:
    gantry = Gantry(machine)
    free: list[int] = []
    for k in range(300):
        speed = 0.03 + 0.02 * np.sin(0.05 * k)
        gantry.drive(speed * X, 0.010)
        status = gantry.core.status
        assert status is not None
        assert status.blocks_free is not None
        free.append(status.blocks_free)
    capacity = max(free)
    assert capacity - np.percentile(free[50:], 99) <= 8
    assert np.mean(free[150:]) == pytest.approx(np.mean(free[50:150]), abs=0.7)
    begun_s = gantry.clock.now_s()
    gantry.core.stop()
    assert gantry.rest_after(begun_s) < 0.10


@ALL
def test_no_more_is_written_ahead_than_a_stop_can_wait_for(machine: Machine) -> None:
    gantry = Gantry(machine)
    write, read = gantry.link.write, gantry.link.read
    waiting: list[int] = []
    most = [0]

    def written(data: bytes) -> None:
        waiting.extend(len(line) + 1 for line in data.split(b"\n") if b"$J" in line)
        most[0] = max(most[0], sum(waiting))
        write(data)

    def heard(timeout_s: float) -> bytes:
        data = read(timeout_s)
        # An ok may come in two parts: its o stands for it.
        del waiting[: data.count(b"o")]
        return data

    gantry.link.write, gantry.link.read = written, heard  # type: ignore[method-assign]
    gantry.drive(0.04 * X + 0.3 * np.roll(X, 4) * (machine.axes == 6), 1.0)
    assert 0 < most[0] <= min(gantry.settings.max_ahead_bytes, machine.rx_bytes - 1)


def test_fast_motion_is_reached_because_the_look_ahead_grows_with_it() -> None:
    gantry = Gantry(USB)
    for speed in np.linspace(0.01, 0.2, 40):
        gantry.drive(speed * X, 0.010)
    gantry.drive(0.2 * X, 1.0)
    assert gantry.firmware.joints()[1][0, 0] == pytest.approx(0.2, rel=0.01)


def test_a_command_right_after_connecting_is_checked_where_the_gantry_is() -> None:
    gantry = Gantry(UART)
    session = Session(gantry.settings, gantry.clock, gantry.link)
    session.core.command(0.03 * X, 0.5, gantry.clock.now_s())
    session.run_for(0.4)
    assert gantry.firmware.joints()[1][0, 0] == pytest.approx(0.03, rel=0.02)


def test_the_self_test_measures_the_delay_of_a_running_stream() -> None:
    gantry = Gantry(UART)
    before = gantry.q()
    delay_s = measure_delay(gantry.session, 5.0).delay_s
    assert delay_s == pytest.approx(0.145, abs=0.03)
    assert gantry.q() == pytest.approx(before, abs=2e-3)
    assert not gantry.moving()


def test_the_same_seed_gives_the_same_bytes() -> None:
    runs = []
    for _ in range(2):
        gantry = Gantry(UART)
        gantry.drive(MIXED, 0.5)
        runs.append(gantry.motion(50.0)[1])
    assert np.array_equal(runs[0], runs[1])
