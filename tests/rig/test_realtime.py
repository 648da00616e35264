"""The conditions of a control loop on the wall clock: obtained where allowed, always given back."""

import gc
import os
import sys

import pytest

from drivers.errors import ConfigError
from rig.realtime import control_conditions, step_back

pytestmark = pytest.mark.realtime


class Scheduler:
    """The system's scheduler as one thread sees it; it may refuse priorities."""

    def __init__(self, refuses: bool) -> None:
        self.refuses = refuses
        self.policy, self.priority = os.SCHED_OTHER, 0

    def set(self, pid: int, policy: int, param: os.sched_param) -> None:
        if self.refuses and policy != os.SCHED_OTHER:
            raise PermissionError(1, "Operation not permitted")
        self.policy, self.priority = policy, param.sched_priority

    def get(self, pid: int) -> int:
        return self.policy


@pytest.fixture(params=[False, True], ids=["allowing", "refusing"])
def scheduler(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Scheduler:
    fake = Scheduler(request.param)
    monkeypatch.setattr(os, "sched_setscheduler", fake.set)
    monkeypatch.setattr(os, "sched_getscheduler", fake.get)
    return fake


def test_auto_takes_the_priority_that_is_allowed(scheduler: Scheduler) -> None:
    with control_conditions("auto") as policy:
        during = scheduler.policy
        assert policy == ("normal" if scheduler.refuses else "realtime")
    assert during == (os.SCHED_OTHER if scheduler.refuses else os.SCHED_RR)
    assert scheduler.policy == os.SCHED_OTHER


def test_normal_asks_for_nothing(scheduler: Scheduler) -> None:
    with control_conditions("normal") as policy:
        assert (policy, scheduler.policy) == ("normal", os.SCHED_OTHER)


def test_realtime_is_obtained_or_an_error_that_says_what_to_type(scheduler: Scheduler) -> None:
    if scheduler.refuses:
        with (
            pytest.raises(ConfigError, match=r"run\.scheduling = realtime.*rtprio"),
            control_conditions("realtime"),
        ):
            pass
    else:
        with control_conditions("realtime") as policy:
            assert (policy, scheduler.policy) == ("realtime", os.SCHED_RR)


def test_a_priority_the_user_gave_the_program_is_left_alone(scheduler: Scheduler) -> None:
    scheduler.policy, scheduler.priority = os.SCHED_FIFO, 50
    with control_conditions("auto") as policy:
        assert (policy, scheduler.policy, scheduler.priority) == ("realtime", os.SCHED_FIFO, 50)
    assert (scheduler.policy, scheduler.priority) == (os.SCHED_FIFO, 50)


def test_helpers_go_after_the_loop_but_before_everything_else(scheduler: Scheduler) -> None:
    with control_conditions("auto"):
        control = scheduler.priority
        step_back()
        assert (0 < scheduler.priority < control) or scheduler.refuses
    scheduler.priority = 0
    step_back()
    assert scheduler.priority == 0  # nothing to step back from


def test_no_garbage_is_collected_meanwhile_and_all_is_as_before_afterwards(
    scheduler: Scheduler,
) -> None:
    interval_s = sys.getswitchinterval()
    frozen = gc.get_freeze_count()
    with pytest.raises(ZeroDivisionError), control_conditions("auto"):
        assert not gc.isenabled()
        assert sys.getswitchinterval() < interval_s
        raise ZeroDivisionError
    assert gc.isenabled()
    assert gc.get_freeze_count() <= frozen
    assert sys.getswitchinterval() == interval_s
    assert scheduler.policy == os.SCHED_OTHER
