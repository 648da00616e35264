"""The supervisor: which states follow from which troubles, and which troubles end a run."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceTimeoutError, SafetyError
from rig.config_safety import ReactionsConfig, SafetyConfig
from rig.outcome import Ending
from rig.supervisor import RigState, Signs, Supervisor, Trouble

CONFIG = SafetyConfig()
STOP_AT_ONCE = SafetyConfig(reactions=ReactionsConfig(**{t.value: "stop" for t in Trouble}))
FINE = Signs(now_s=0.0)
HELD = [t for t in Trouble if getattr(CONFIG.reactions, t.value) == "hold"]


def started(config: SafetyConfig = CONFIG) -> Supervisor:
    supervisor = Supervisor(config)
    supervisor.start(0.0)
    return supervisor


def with_trouble(trouble: Trouble, now_s: float, age_s: float = 0.5) -> Signs:
    signs = Signs(now_s=now_s, image_age_s=age_s, feature_age_s=age_s)
    return replace(signs, **{trouble.value: "something is wrong"})


def test_a_run_goes_from_idle_over_starting_to_running() -> None:
    supervisor = Supervisor(CONFIG)
    assert supervisor.state is RigState.IDLE
    supervisor.start(0.0)
    assert supervisor.judge(Signs(0.01, seen=False, no_image="none yet")).state is RigState.STARTING
    assert supervisor.judge(FINE).state is RigState.RUNNING


@pytest.mark.parametrize("trouble", HELD)
def test_a_trouble_holds_the_arm_until_it_is_over(trouble: Trouble) -> None:
    supervisor = started()
    supervisor.judge(FINE)
    verdict = supervisor.judge(with_trouble(trouble, 1.0))
    assert verdict.state is RigState.HOLDING
    assert trouble.value in verdict.detail
    assert "something is wrong" in verdict.detail
    assert supervisor.judge(replace(FINE, now_s=1.1)).state is RigState.RUNNING
    assert supervisor.holds == 1


@pytest.mark.parametrize("trouble", list(Trouble))
def test_a_trouble_configured_to_stop_ends_the_run_at_once(trouble: Trouble) -> None:
    supervisor = started(STOP_AT_ONCE)
    supervisor.judge(FINE)
    verdict = supervisor.judge(with_trouble(trouble, 1.0))
    assert verdict.state is RigState.STOPPING
    assert verdict.ending is not None
    if trouble is Trouble.TARGET_LOST:
        assert verdict.ending is Ending.TARGET_LOST
    elif trouble in (Trouble.NO_IMAGE, Trouble.STALE_STATE):
        assert isinstance(verdict.error, DeviceTimeoutError)
    else:
        assert isinstance(verdict.error, SafetyError)
        assert trouble.value in str(verdict.error)


@pytest.mark.parametrize("trouble", [t for t in HELD if t is not Trouble.ENVELOPE])
def test_a_trouble_that_lasts_ends_the_run(trouble: Trouble) -> None:
    supervisor = started()
    supervisor.judge(FINE)
    verdict = supervisor.judge(with_trouble(trouble, 1.0))
    assert verdict.ending is None
    late_s = 1.0 + max(CONFIG.hold_timeout_s, CONFIG.target_lost_after_s) + 0.1
    assert supervisor.judge(with_trouble(trouble, late_s, late_s)).ending is not None


def test_a_trouble_that_comes_and_goes_is_timed_anew() -> None:
    supervisor = started()
    supervisor.judge(FINE)
    for k in range(200):
        signs = with_trouble(Trouble.OVERRUN, 0.1 * k) if k % 2 else replace(FINE, now_s=0.1 * k)
        assert supervisor.judge(signs).ending is None
    assert supervisor.holds == 100


def test_an_envelope_reached_holds_to_the_end_of_the_run() -> None:
    supervisor = started()
    supervisor.judge(FINE)
    for k in range(100):
        verdict = supervisor.judge(with_trouble(Trouble.ENVELOPE, float(k)))
        assert (verdict.state, verdict.ending) == (RigState.HOLDING, None)


def test_a_search_is_no_loss_even_where_losses_stop_the_run() -> None:
    supervisor = started(STOP_AT_ONCE)
    searching = Signs(0.5, seen=False, feature_age_s=0.5, target_lost="no outline")
    assert supervisor.judge(searching).state is RigState.STARTING
    late = replace(searching, now_s=3.0, feature_age_s=3.0)
    assert supervisor.judge(late).ending is Ending.TARGET_LOST


@given(st.lists(st.sampled_from([None, *Trouble]), min_size=1, max_size=60))
def test_the_arm_runs_only_while_nothing_is_wrong(troubles: list[Trouble | None]) -> None:
    supervisor = started()
    for k, trouble in enumerate(troubles):
        signs = replace(FINE, now_s=0.01 * k)
        verdict = supervisor.judge(with_trouble(trouble, 0.01 * k) if trouble else signs)
        assert (verdict.state is RigState.RUNNING) == (trouble is None)
        if verdict.ending is not None:
            return
