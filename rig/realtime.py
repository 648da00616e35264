"""What a control loop on the wall clock asks of the system and of the interpreter."""

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from drivers.errors import ConfigError

Scheduling = Literal["auto", "normal", "realtime"]
Policy = Literal["normal", "realtime"]

_REALTIME = (os.SCHED_RR, os.SCHED_FIFO)
# Below the processes that talk to controllers (10): they do little, and what they do is due.
_PRIORITY = 5
# Helping threads keep a priority of this kind: one that is put aside by the system while it holds
# the interpreter would hold up the control thread with it.
_HELPER_PRIORITY = 1
# A thread that waits for the interpreter asks for it after this long; Python's own 5 ms is half
# a control period. Matters for the log, the view, and vision where it is a thread.
_SWITCH_INTERVAL_S = 2e-4


@contextmanager
def control_conditions(scheduling: Scheduling) -> Iterator[Policy]:
    """Run the calling thread, and threads started meanwhile, as undisturbed as is allowed.

    No garbage is collected meanwhile: a full collection takes 70 ms with everything imported,
    and the loop makes no cycles (none in a run of 10 s, views included). Yields the scheduling
    policy obtained, "realtime" or "normal"; everything is as before afterwards. Raises
    ConfigError when "realtime" is demanded and the system refuses.
    """
    # Whoever started the program under a real-time policy (chrt) has chosen the priority.
    given = os.sched_getscheduler(0) in _REALTIME
    policy: Policy = "realtime" if given else _raised(scheduling)
    switch_interval_s = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield policy
    finally:
        gc.enable()
        gc.unfreeze()
        sys.setswitchinterval(switch_interval_s)
        if policy == "realtime" and not given:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def step_back() -> None:
    """Let the control loop go first; for a thread that was started under its conditions."""
    if os.sched_getscheduler(0) in _REALTIME:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_HELPER_PRIORITY))


def _raised(scheduling: Scheduling) -> Policy:
    if scheduling == "normal":
        return "normal"
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except OSError as error:
        if scheduling == "auto":
            return "normal"
        raise ConfigError(
            f"run.scheduling = realtime: the system does not allow it ({error}); allow it with "
            '`echo "$USER - rtprio 20" | sudo tee '
            "/etc/security/limits.d/activerig.conf` and log in again, or choose auto"
        ) from error
    return "realtime"
