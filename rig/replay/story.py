"""What a log's events and ticks tell of a run, besides what was estimated."""

from dataclasses import dataclass, field

from rig.outcome import Ending, RunOutcome
from rig.replay.recording import Event, Tick
from rig.run_data import RunData
from rig.schedule import TickStats


@dataclass(slots=True)
class Story:
    """Collects; ``outcome`` then is the one that the run had, as far as the log goes."""

    stats: TickStats = field(default_factory=lambda: TickStats(scheduling="replay"))
    started_s: float | None = None
    ended_s: float | None = None  # None: the log stops in the middle
    ending: Ending | None = None
    error: str = ""  # why a failed run ended
    target_state: str = "searching: no image arrived yet"
    holds: int = 0
    last_hold: str = ""
    at_rest: bool = False
    last_s: float = 0.0
    events: list[Event] = field(default_factory=list)

    def tick(self, tick: Tick) -> None:
        """One tick of the loop."""
        self.stats.ticks += 1
        self.stats.overruns = tick.overruns
        self.stats.late_s.append(tick.late_s)
        self.last_s = tick.t_s

    def event(self, event: Event) -> None:
        """One event."""
        self.events.append(event)
        self.last_s = event.t_s
        if event.name == "started":
            self.started_s = event.t_s
        elif event.name == "ended":
            self.ended_s = event.t_s
            words, _, self.error = event.detail.partition(": ")
            self.ending = next((one for one in Ending if one.value == words), None)
        elif event.name == "state holding":
            self.holds, self.last_hold = self.holds + 1, event.detail
        elif event.name == "state stopped":
            self.at_rest = True
        elif event.name in ("target tracking", "target lost"):
            state = event.name.removeprefix("target ")
            self.target_state = f"{state}: {event.detail}" if event.detail else state

    def outcome(self, data: RunData, remaining_fraction: float) -> RunOutcome:
        """How the run went; one whose log stops in the middle counts as interrupted."""
        started_s = self.last_s if self.started_s is None else self.started_s
        return RunOutcome(
            ending=self.ending or Ending.INTERRUPTED,
            data=data,
            stats=self.stats,
            started_s=started_s,
            ended_s=self.last_s if self.ended_s is None else self.ended_s,
            at_rest=self.at_rest,
            remaining_fraction=remaining_fraction,
            target_state=self.target_state,
            holds=self.holds,
            last_hold=self.last_hold,
            error=None,
        )
