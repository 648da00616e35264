"""Ways of several straight legs, by way of poses where the arm has been."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.reach import Reach, Way

FloatArray = NDArray[np.float64]


class Routes:
    """The straight way where that is free, or else back to one of ``rests`` and on from there.

    ``rests`` are poses (4, 4) where the arm stood: the first look, and the one it came from,
    to which it gets back as it came. All ways begin where ``reach`` does.
    """

    def __init__(self, reach: Reach, rests: Sequence[FloatArray]) -> None:
        self._reach = reach
        self._rests = rests
        self._starts: list[tuple[tuple[Way, ...], Reach]] | None = None

    def __call__(self, T_base_tool: FloatArray) -> bool:
        """Whether one of the ways is free."""
        return not self.find(T_base_tool)[-1].blocked_by

    def to(self, T_base_tool: FloatArray) -> tuple[Way, ...]:
        """The legs to a pose (4, 4); raises PoseRefusedError when no way is free."""
        legs = self.find(T_base_tool)
        if legs[-1].blocked_by:
            raise PoseRefusedError(f"no way there is free: {legs[-1].blocked_by}")
        return legs

    def find(self, T_base_tool: FloatArray) -> tuple[Way, ...]:
        """The legs to a pose (4, 4); when no way is free, the straight one as far as it is."""
        straight = self._reach.way(T_base_tool)
        if not straight.blocked_by:
            return (straight,)
        for legs, reach in self._beginnings():
            last = reach.way(T_base_tool)
            if not last.blocked_by:
                return (*legs, last)
        return (straight,)

    def _beginnings(self) -> list[tuple[tuple[Way, ...], Reach]]:
        """Free ways back: to each of the rests, and to the first by way of the others."""
        if self._starts is None:
            self._starts = []
            for rest in self._rests:
                back = self._reach.way(rest)
                if back.blocked_by:
                    continue
                there = self._reach.after(back)
                self._starts.append(((back,), there))
                home = there.way(self._rests[0])
                if rest is not self._rests[0] and not home.blocked_by:
                    self._starts.append(((back, home), there.after(home)))
        return self._starts
