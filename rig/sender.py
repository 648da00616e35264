"""The last step before the arm: limited, given a time to live, and never sent too late."""

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.interfaces import Arm
from rig.deadman import Deadman
from rig.envelope import Surroundings
from rig.safety import Allowed, Limiter

FloatArray = NDArray[np.float64]

HELD_UP = "held up"


class Sender:
    """Sends tool twists through a limiter; each lives ``hold_s``, guarded by a deadman if given.

    A program can be held up anywhere, by a busy machine or by whoever suspends it. What it
    decided before that is then old: by its time to live the arm rests already, and rest is all
    that is sent. The next motion ramps up from the measured one.
    """

    def __init__(
        self, arm: Arm, clock: Clock, limiter: Limiter, hold_s: float, deadman: Deadman | None
    ) -> None:
        self._arm = arm
        self._clock = clock
        self._limiter = limiter
        self._hold_s = hold_s
        self._deadman = deadman
        self._sent_s = -np.inf

    def send(
        self, wanted: FloatArray, around: Surroundings, decided_s: float, dt_s: float
    ) -> Allowed:
        """Command what the envelope allows of ``wanted`` (6,); says what that is.

        ``decided_s`` is the instant whose measurements ``wanted`` and ``around`` rest on, the
        tick's. Raises SafetyError as the limiter does, and what the arm does.
        """
        if self._clock.now_s() - self._sent_s > self._hold_s:
            self._limiter.restart()  # the last command has run out meanwhile
        allowed = self._limiter.limit(wanted, around, dt_s)
        if self._clock.now_s() - decided_s > self._hold_s:
            self._limiter.restart()
            allowed = Allowed(np.zeros(6), (*allowed.reasons, HELD_UP), allowed.blocked)
        self._arm.command_twist(allowed.twist_tool, self._hold_s)
        self._sent_s = self._clock.now_s()
        if self._deadman is not None:
            self._deadman.feed()
        return allowed
