"""The replay itself: the live code, fed from a log."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivers.clock import Clock, WallClock
from drivers.errors import SafetyError
from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from estimator.image.intrinsics import Intrinsics
from estimator.image.tracker import TargetTracker, warm_up
from rig.analysis import Analysis, analyse
from rig.config import RigConfig
from rig.convergence import make_convergence
from rig.outcome import Ending, RunOutcome
from rig.records import Json
from rig.replay.recording import Estimated, Event, Recording, Seen, States, Tick
from rig.replay.settings import Source, check_answerable, geometry_of
from rig.replay.story import Story
from rig.run import make_fusion
from rig.run_data import RunData
from rig.servo import servo_figures
from rig.summary import summarise
from rig.vision import Sighting


@dataclass(slots=True)
class Kept:
    """What an estimator said, live or in a replay."""

    updates: list[Estimate] = field(default_factory=list)
    predictions: list[Estimate] = field(default_factory=list)

    def estimate(self, kind: str, estimate: Estimate) -> None:
        """The state after an image (``kind`` update) or predicted to a tick (estimate)."""
        (self.updates if kind == "update" else self.predictions).append(estimate)

    def states(self, states: Sequence[ArmState]) -> None:
        """Nothing to keep."""

    def frame(self, sighting: Sighting, handled_s: float) -> None:
        """Nothing to keep."""

    def event(self, t_s: float, name: str, detail: str = "") -> None:
        """Nothing to keep."""


@dataclass(frozen=True, slots=True)
class Replay:
    """A finished replay, beside what the log says of the run."""

    config: RigConfig
    summary: dict[str, Json]
    outcome: RunOutcome
    analysis: Analysis
    intrinsics: Intrinsics
    replayed: Kept
    recorded: Kept
    images_missing: int  # of --from images: their recorded features were used
    story: Story


def replay(
    recording: Recording, assignments: list[str] | None = None, source: Source = "features"
) -> Replay:
    """Run the recorded run's inputs through vision (from images) and the estimator again.

    Raises ConfigError for settings that a replay says nothing about.
    """
    changes = assignments or []
    check_answerable(changes, source)
    config = recording.config(changes)
    intrinsics, T_tool_camera = geometry_of(recording, config)
    data, kept = RunData(recording.target, T_tool_camera), Kept()
    vision = None
    if source == "images":
        warm_up(recording.target, intrinsics, config.camera.method)
        vision = TargetTracker(recording.target, intrinsics, config.camera.method)
    worker = _Worker(recording, config, data, kept, vision)
    clock: Clock = WallClock()
    begun_s = clock.now_s()
    outcome = worker.run(source == "images")
    wall_s = clock.now_s() - begun_s
    analysis = analyse(data, config, recording.radius_true_m)
    run_dir = Path(recording.log.path).parent
    summary = summarise(
        recording.target, outcome, analysis, config, recording.renderer, wall_s, run_dir
    )
    summary |= servo_figures(data, config, intrinsics)
    return Replay(
        config=config,
        summary=summary,
        outcome=outcome,
        analysis=analysis,
        intrinsics=intrinsics,
        replayed=kept,
        recorded=worker.recorded,
        images_missing=worker.images_missing,
        story=worker.story,
    )


class _Worker:
    """Feeds one recording to a fusion as the control loop did."""

    def __init__(
        self,
        recording: Recording,
        config: RigConfig,
        data: RunData,
        kept: Kept,
        vision: TargetTracker | None,
    ) -> None:
        self._recording = recording
        self._data = data
        self._fusion = make_fusion(config, recording.target, data, kept)
        self._convergence = make_convergence(config, data)
        self._vision = vision
        self.recorded = Kept()
        self.images_missing = 0
        self.story = Story()

    def run(self, images: bool) -> RunOutcome:
        failure: SafetyError | None = None
        for step in self._recording.steps(images):
            if isinstance(step, States):
                self._fusion.add_states(step.states)
            elif isinstance(step, Seen):
                self._fusion.add_sightings([self._sighting(step)], step.handled_s)
            elif isinstance(step, Estimated):
                self.recorded.estimate(step.kind, step.estimate)
            elif isinstance(step, Event):
                self.story.event(step)
            elif failure is None:
                failure = self._tick(step)
        outcome = self.story.outcome(self._data, self._convergence.remaining_fraction)
        if failure is not None and self.story.ending is not Ending.SAFETY_STOP:
            return replace(outcome, ending=Ending.SAFETY_STOP, error=failure)
        return outcome

    def _tick(self, tick: Tick) -> SafetyError | None:
        self.story.tick(tick)
        try:
            self._fusion.advance(tick.t_s)
        except SafetyError as error:
            return error
        self._convergence.update()
        return None

    def _sighting(self, seen: Seen) -> Sighting:
        if self._vision is None:
            return seen.sighting
        if seen.image is None:
            self.images_missing += 1
            return seen.sighting
        frame = replace(seen.sighting.frame, image=seen.image)
        return Sighting(frame, self._vision.measure(seen.image))
