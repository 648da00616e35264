"""The loop: how runs end, and that every ending leaves the arm at rest."""

from pathlib import Path

import numpy as np
import pytest

from rig.outcome import Ending, LiveStatus
from tests.rig.fakes import RADIUS_M, make_bench
from tests.rig.log_lines import log_bytes, log_lines


def assert_stopped(bench) -> None:  # type: ignore[no-untyped-def]
    """The arm was told to stop and its last measured sample is at rest."""
    assert bench.arm.stops >= 1
    bench.clock.sleep_until(bench.clock.now_s() + 0.5)
    bench.arm.fail_at_s = np.inf
    bench.arm.read_states()
    assert not np.any(bench.arm.history[-1].twist_tool)


def test_a_run_ends_by_time_with_the_radius_found(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=6"])
    outcome = bench.run()
    assert outcome.ending is Ending.TIME
    assert outcome.at_rest
    assert 6.0 <= outcome.ended_s - outcome.started_s < 6.5
    assert bench.data.updates[-1].radius_m == pytest.approx(RADIUS_M, rel=1e-3)
    assert_stopped(bench)


def test_a_run_ends_by_itself_when_it_has_converged(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=60", "run.until_converged=true"])
    outcome = bench.run()
    assert outcome.ending is Ending.CONVERGED
    assert outcome.ended_s < 10.0
    assert outcome.remaining_fraction < bench.config.run.converged_fraction
    assert bench.data.updates[-1].radius_m == pytest.approx(RADIUS_M, rel=3e-3)
    assert_stopped(bench)


def test_a_stop_request_ramps_down_within_the_acceleration_limit(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, stop_requested=lambda clock: clock.now_s() >= 2.0)
    outcome = bench.run()
    assert outcome.ending is Ending.INTERRUPTED
    assert outcome.at_rest
    times = np.array([t for t, _ in bench.arm.commands])
    speeds = np.array([np.linalg.norm(twist[:3]) for _, twist in bench.arm.commands])
    after = times >= 2.0
    assert speeds[~after][-1] == pytest.approx(0.05, rel=1e-2)  # it was moving
    assert speeds[-1] == 0.0
    limit = bench.config.safety.max_linear_acceleration_m_s2
    steps = np.abs(np.diff(speeds)) / np.maximum(np.diff(times), 0.01)
    assert steps[after[1:]].max() <= limit * (1 + 1e-6)


def test_the_first_command_is_small_and_speed_builds_up_smoothly(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=1"])
    bench.run()
    first_moving = next(twist for _, twist in bench.arm.commands if np.any(twist))
    limit = bench.config.safety.max_linear_acceleration_m_s2
    assert np.linalg.norm(first_moving[:3]) <= limit * 0.01 * (1 + 1e-6)


def test_no_motion_before_the_target_has_been_seen(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.vision.hidden = lambda t_s: t_s < 1.0
    bench.run()
    first_moving_s = next(t for t, twist in bench.arm.commands if np.any(twist))
    assert first_moving_s >= 1.0


def test_a_target_never_seen_ends_the_run_without_motion(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.vision.hidden = lambda t_s: True
    outcome = bench.run()
    assert outcome.ending is Ending.TARGET_LOST
    assert "hidden by the test" in outcome.target_state
    assert not any(np.any(twist) for _, twist in bench.arm.commands)


@pytest.mark.parametrize("fault", ["hidden", "frozen"])
def test_a_lost_target_stops_the_arm_first_and_the_run_later(tmp_path: Path, fault: str) -> None:
    bench = make_bench(tmp_path)
    if fault == "hidden":
        bench.vision.hidden = lambda t_s: t_s > 2.0
    else:
        bench.vision.frozen_from_s = 2.0
    outcome = bench.run()
    # Images without the target lose it; no images at all are the camera's failure.
    if fault == "hidden":
        assert outcome.ending is Ending.TARGET_LOST
    else:
        assert outcome.ending is Ending.DEVICE_FAILURE
        assert "no image for 2.0" in str(outcome.error)
    safety = bench.config.safety
    # Within the age limit, the frame before it, and the ramp, the command is zero.
    ramp_s = 0.05 / safety.max_linear_acceleration_m_s2
    resting_s = 2.0 + safety.max_feature_age_s + ramp_s + 0.02
    assert all(not np.any(twist) for t, twist in bench.arm.commands if t > resting_s)
    assert outcome.ended_s == pytest.approx(2.0 + safety.target_lost_after_s, abs=0.3)
    assert_stopped(bench)


def test_a_target_seen_again_in_time_is_measured_to_the_end(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=9"])
    bench.vision.hidden = lambda t_s: 2.0 < t_s < 3.0
    outcome = bench.run()
    assert outcome.ending is Ending.TIME
    assert bench.data.updates[-1].radius_m == pytest.approx(RADIUS_M, rel=2e-3)


def test_a_broken_arm_ends_the_run_and_is_told_to_stop(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.arm.fail_at_s = 1.5
    outcome = bench.run()
    assert outcome.ending is Ending.DEVICE_FAILURE
    assert "cable" in str(outcome.error)
    assert not outcome.at_rest  # nobody can say: it reports nothing
    assert_stopped(bench)


def test_a_broken_camera_ends_the_run_with_the_arm_at_rest(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.vision.error_at_s = 1.5
    outcome = bench.run()
    assert outcome.ending is Ending.DEVICE_FAILURE
    assert outcome.at_rest
    assert_stopped(bench)


def test_an_arm_that_stops_reporting_is_a_device_failure(tmp_path: Path) -> None:
    bench = make_bench(tmp_path)
    bench.arm.silent_from_s = 1.5
    outcome = bench.run()
    assert outcome.ending is Ending.DEVICE_FAILURE
    limit_s = bench.config.safety.max_state_age_s
    assert max(t for t, twist in bench.arm.commands if np.any(twist)) < 1.5 + limit_s + 0.02
    assert_stopped(bench)


@pytest.mark.parametrize("kind", [RuntimeError, KeyboardInterrupt, BrokenPipeError])
def test_a_crash_anywhere_in_the_loop_stops_the_arm(
    tmp_path: Path, kind: type[BaseException]
) -> None:
    def crash(status: LiveStatus) -> None:
        if status.elapsed_s > 1.0:
            raise kind("a crash while drawing")

    bench = make_bench(tmp_path, on_tick=crash)
    with pytest.raises(kind):
        bench.run()
    assert_stopped(bench)


def test_a_loop_that_hangs_leaves_an_arm_that_stops_by_itself(tmp_path: Path) -> None:
    stalled_at_s = 0.0

    def hang(status: LiveStatus) -> None:
        nonlocal stalled_at_s
        if status.elapsed_s > 1.0 and not stalled_at_s:
            stalled_at_s = bench.clock.now_s()
            bench.clock.sleep_until(stalled_at_s + 1.0)

    bench = make_bench(tmp_path, ["safety.target_lost_after_s=3", "run.duration_s=3"], on_tick=hang)
    outcome = bench.run()
    hold_s = bench.config.arm.hold_s
    during = [
        s for s in bench.arm.history if stalled_at_s + hold_s + 0.01 < s.t_s < stalled_at_s + 1.0
    ]
    assert during
    assert not any(np.any(s.twist_tool) for s in during)
    assert outcome.stats.overruns >= 98


def test_the_same_run_writes_the_same_log(tmp_path: Path) -> None:
    logs = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        make_bench(tmp_path / name, ["run.duration_s=2"]).run()
        logs.append(log_bytes(tmp_path / name))
    assert logs[0] == logs[1]
    assert len(logs[0]) > 100_000


def events(run_dir: Path) -> list[tuple[str, str]]:
    """The names and details of the log's events."""
    return [(r["event"], r["detail"]) for r in log_lines(run_dir) if r["kind"] == "event"]


def test_the_log_tells_every_state_of_a_run(tmp_path: Path) -> None:
    make_bench(tmp_path, ["run.duration_s=1"]).run()
    names = [name for name, _ in events(tmp_path) if name.startswith("state")]
    assert names == ["state running", "state stopping", "state stopped"]


def test_a_loop_held_up_holds_the_arm_and_starts_again_from_rest(tmp_path: Path) -> None:
    hung: list[float] = []

    def hang(status: LiveStatus) -> None:
        if status.elapsed_s > 1.0 and not hung:
            hung.append(bench.clock.now_s())
            bench.clock.sleep_until(hung[0] + 0.5)

    bench = make_bench(tmp_path, ["run.duration_s=3"], on_tick=hang)
    outcome = bench.run()
    assert outcome.ending is Ending.TIME
    assert outcome.holds == 1
    assert "held up" in outcome.last_hold
    after = [twist for t, twist in bench.arm.commands if t > hung[0] + 0.1]
    limit = bench.config.safety.max_linear_acceleration_m_s2
    assert np.linalg.norm(after[1][:3]) <= 2 * limit * 0.01 * (1 + 1e-6)


def test_a_tick_held_up_before_its_command_does_not_send_it(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=3"])
    poll, hung = bench.vision.poll, []

    def hang():
        if bench.clock.now_s() > 1.0 and not hung:
            bench.clock.sleep_until(bench.clock.now_s() + 0.5)
            hung.append(bench.clock.now_s())
        return poll()

    bench.vision.poll = hang
    bench.run()
    after = [twist for t, twist in bench.arm.commands if t >= hung[0]]
    assert not np.any(after[0])
    limit = bench.config.safety.max_linear_acceleration_m_s2
    assert np.linalg.norm(after[1][:3]) <= 2 * limit * 0.01 * (1 + 1e-6)


def test_a_wall_in_the_way_holds_the_arm_and_keeps_the_measurement(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=6", "safety.workspace_min_m=[-0.12,-2,0.05]"])
    outcome = bench.run()
    assert outcome.ending is Ending.TIME
    assert outcome.holds == 1
    assert "workspace x min" in outcome.last_hold
    assert min(s.T_base_tool[0, 3] for s in bench.arm.history) > -0.12
    assert bench.arm.history[-1].T_base_tool[0, 3] < -0.11
    assert bench.data.updates[-1].radius_m == pytest.approx(RADIUS_M, rel=0.02)


def test_a_wall_ends_the_run_where_that_is_wanted(tmp_path: Path) -> None:
    wall = ["safety.workspace_min_m=[-0.05,-2,0.05]", "safety.reactions.envelope=stop"]
    bench = make_bench(tmp_path, wall)
    outcome = bench.run()
    assert outcome.ending is Ending.SAFETY_STOP
    assert "workspace x min" in str(outcome.error)
    assert ("state fault", str(outcome.error)) in events(tmp_path)
    assert_stopped(bench)


def test_an_estimate_that_images_contradict_stops_the_run(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=9", "safety.max_residual=1e-9"])
    outcome = bench.run()
    assert outcome.ending is Ending.SAFETY_STOP
    assert "diverged" in str(outcome.error)
    assert_stopped(bench)


def test_a_camera_that_pauses_is_waited_for(tmp_path: Path) -> None:
    resumed = False

    def resume(status: LiveStatus) -> None:
        nonlocal resumed
        if bench.clock.now_s() > 3.0 and not resumed:
            resumed, bench.vision.frozen_from_s = True, np.inf
            bench.vision.seq = int(bench.clock.now_s() * 30)

    bench = make_bench(tmp_path, ["run.duration_s=5"], on_tick=resume)
    bench.vision.frozen_from_s = 2.0
    outcome = bench.run()
    assert outcome.ending is Ending.TIME
    assert outcome.holds == 1
    assert "no image" in outcome.last_hold
    resting = [twist for t, twist in bench.arm.commands if 2.5 < t < 3.0]
    assert resting
    assert not np.any(resting)
    assert bench.data.updates[-1].radius_m == pytest.approx(RADIUS_M, rel=5e-3)


def test_a_held_arm_does_not_unsettle_what_has_settled(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=9", "safety.workspace_min_m=[-0.25,-2,0.05]"])
    outcome = bench.run()
    assert outcome.holds == 1
    assert outcome.remaining_fraction < 5e-3
