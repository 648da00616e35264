"""How much motion is under way: the number that decides whether to send another block."""

from collections import deque


class Flow:
    """Blocks sent and not yet prepared by the controller, in seconds of motion.

    The controller prepares about 90 ms ahead of the motors; what it has prepared appears in no
    report. Blocks it acknowledged but has not prepared are its planner's, counted by ``Bf``
    in each report; between reports they shrink as time passes.
    """

    def __init__(self, planner_blocks: int) -> None:
        self._capacity = planner_blocks
        self._unacknowledged: deque[tuple[float, int]] = deque()  # duration, bytes
        self._planned: deque[float] = deque()  # durations, the oldest may be partly done
        self._planned_s = 0.0  # at the last report, plus what was acknowledged since
        self._report_s = float("-inf")
        self.unacknowledged_bytes = 0
        self._unacknowledged_s = 0.0

    def clear(self) -> None:
        """Forget everything: the queue has been flushed."""
        self._unacknowledged.clear()
        self._planned.clear()
        self._planned_s = self._unacknowledged_s = 0.0
        self.unacknowledged_bytes = 0

    def sent(self, duration_s: float, size: int) -> None:
        """A block has been written."""
        self._unacknowledged.append((duration_s, size))
        self.unacknowledged_bytes += size
        self._unacknowledged_s += duration_s

    def acknowledged(self, t_s: float) -> None:
        """An ``ok``: the oldest block is planned. One too many is ignored."""
        if not self._unacknowledged:
            return
        self._settle(t_s)
        duration_s, size = self._unacknowledged.popleft()
        self.unacknowledged_bytes -= size
        self._unacknowledged_s -= duration_s
        self._planned.append(duration_s)
        self._planned_s += duration_s

    def reported(self, blocks_free: int, t_s: float) -> None:
        """A report of free planner blocks, true at ``t_s``."""
        count = max(self._capacity - blocks_free, 0)
        while len(self._planned) > count:
            self._planned.popleft()
        self._planned_s = sum(self._planned)
        self._report_s = t_s

    def ahead_s(self, t_s: float) -> float:
        """Seconds of motion sent but not prepared; the unacknowledged never shrink by waiting."""
        elapsed_s = max(t_s - self._report_s, 0.0)
        return max(self._planned_s - elapsed_s, 0.0) + self._unacknowledged_s

    def _settle(self, t_s: float) -> None:
        """Account for the time passed, so that a block planned late is not aged by it."""
        if t_s > self._report_s:
            self._planned_s = max(self._planned_s - (t_s - self._report_s), 0.0)
            self._report_s = t_s
