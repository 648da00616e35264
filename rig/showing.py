"""Puts together what those who watch a run are shown, tick by tick and to its very end."""

from collections.abc import Callable

from estimator.estimate import Estimate
from rig.convergence import Convergence
from rig.fusion import Fusion
from rig.outcome import LiveStatus
from rig.run_data import RunData
from rig.schedule import TickStats


class Showing:
    """Hands a ``LiveStatus`` to ``on_tick`` whenever the loop says where it is."""

    def __init__(
        self,
        on_tick: Callable[[LiveStatus], None],
        fusion: Fusion,
        data: RunData,
        stats: TickStats,
        convergence: Convergence,
        servo: Callable[[Estimate], str],
    ) -> None:
        self._on_tick = on_tick
        self._fusion = fusion
        self._data = data
        self._stats = stats
        self._convergence = convergence
        self._servo = servo
        self._estimate: Estimate | None = None
        self.started_s = 0.0

    def show(
        self,
        now_s: float,
        state: str,
        target_state: str,
        estimate: Estimate | None,
        limited_by: tuple[str, ...] = (),
    ) -> None:
        """One state; without an estimate the last one stands."""
        self._estimate = estimate or self._estimate
        self._on_tick(
            LiveStatus(
                elapsed_s=now_s - self.started_s,
                state=state,
                estimate=self._estimate,
                target_state=target_state,
                frames=self._data.frames,
                frames_lost=self._data.frames_lost,
                ticks=self._stats.ticks,
                overruns=self._stats.overruns,
                speed_m_s=self._fusion.camera_speed_m_s(),
                limited_by=limited_by,
                remaining_fraction=self._convergence.remaining_fraction,
                late_s=self._stats.late_s[-1] if self._stats.late_s else 0.0,
                arm=self._fusion.state,
                sighting=self._fusion.newest_sighting,
                servo="" if self._estimate is None else self._servo(self._estimate),
            )
        )
