"""Who decides whether the arm may move: explicit states, and what each trouble leads to.

    idle → starting → running ⇄ holding → stopping → stopped
                any of them → fault

Only ``running`` lets the controller's motion through; in every other state the command ramps
to zero. The last command is never simply continued: each has a time to live.
"""

from dataclasses import dataclass
from enum import StrEnum

from drivers.errors import DeviceTimeoutError, RigError, SafetyError
from rig.config_safety import SafetyConfig
from rig.outcome import Ending

# Cameras and processes take their time to begin.
_FIRST_IMAGE_S = 5.0


class RigState(StrEnum):
    """Where a run is."""

    IDLE = "idle"  # not begun
    STARTING = "starting"  # devices report, the target has not been seen yet
    RUNNING = "running"  # the controller moves the arm
    HOLDING = "holding"  # at rest until a trouble is over
    STOPPING = "stopping"  # ramping to rest for good
    STOPPED = "stopped"  # measured at rest
    FAULT = "fault"  # a device or the safety ended it; told to stop at once


class Trouble(StrEnum):
    """What can be wrong while every device still answers."""

    STALE_STATE = "stale_state"
    OVERRUN = "overrun"
    NO_IMAGE = "no_image"
    TARGET_LOST = "target_lost"
    DIVERGED = "diverged"
    ENVELOPE = "envelope"


@dataclass(frozen=True, slots=True)
class Signs:
    """What the loop noticed at one tick; an empty string is no trouble."""

    now_s: float
    seen: bool = True  # whether the target has ever been seen
    image_age_s: float = 0.0  # since the newest image came, or the start
    feature_age_s: float = 0.0  # since the newest image with the target was exposed, or the start
    stale_state: str = ""
    overrun: str = ""
    no_image: str = ""
    target_lost: str = ""  # images come, without the target; searching counts too
    diverged: str = ""
    envelope: str = ""

    def of(self, trouble: Trouble) -> str:
        """What is wrong in that way, or ""."""
        return str(getattr(self, trouble.value))


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the run is to do now."""

    state: RigState
    detail: str = ""  # why, in words
    ending: Ending | None = None  # the run is over
    error: RigError | None = None  # why it is over, where that is a failure


@dataclass(frozen=True, slots=True)
class Transition:
    """One change of state."""

    t_s: float
    state: RigState
    detail: str


class Supervisor:
    """Turns each tick's signs into a state, and a trouble that lasts into an end."""

    def __init__(self, config: SafetyConfig) -> None:
        self._config = config
        self._since_s: dict[Trouble, float] = {}
        self.state = RigState.IDLE
        self.transitions: list[Transition] = []

    @property
    def holds(self) -> int:
        """How often the arm was held."""
        return sum(change.state is RigState.HOLDING for change in self.transitions)

    def start(self, now_s: float) -> None:
        """The loop begins to tick."""
        self.enter(RigState.STARTING, now_s, "waiting for the target")

    def judge(self, signs: Signs) -> Verdict:
        """The state that this tick's signs lead to.

        Until the target is seen for the first time the run is starting; time limits count all
        the same.
        """
        self._note(signs)
        present = [trouble for trouble in Trouble if trouble in self._since_s]
        for trouble in present:
            over = self._end(trouble, signs)
            if over is not None:
                return over
        if not signs.seen:
            return Verdict(self.state, signs.target_lost or signs.no_image)
        if present:
            detail = f"{present[0].value}: {signs.of(present[0])}"
            self.enter(RigState.HOLDING, signs.now_s, detail)
            return Verdict(RigState.HOLDING, detail)
        self.enter(RigState.RUNNING, signs.now_s, "")
        return Verdict(RigState.RUNNING)

    def enter(self, state: RigState, now_s: float, detail: str) -> None:
        """Go to ``state``; a change of the detail alone is no transition."""
        if state is not self.state:
            self.state = state
            self.transitions.append(Transition(now_s, state, detail))

    def _note(self, signs: Signs) -> None:
        """Remember since when each trouble has lasted."""
        for trouble in Trouble:
            if not signs.of(trouble):
                self._since_s.pop(trouble, None)
            else:
                self._since_s.setdefault(trouble, signs.now_s)

    def _end(self, trouble: Trouble, signs: Signs) -> Verdict | None:
        """The verdict when ``trouble`` ends the run: by its reaction, or because it lasts."""
        config, text = self._config, signs.of(trouble)
        lasted_s, limit_s = signs.now_s - self._since_s[trouble], config.hold_timeout_s
        # Before the first sight there is nothing to stop; the search has its time.
        stops = signs.seen and getattr(config.reactions, trouble.value) == "stop"
        if trouble is Trouble.TARGET_LOST:
            lasted_s, limit_s = signs.feature_age_s, config.target_lost_after_s
        elif trouble is Trouble.NO_IMAGE:
            lasted_s, limit_s = signs.image_age_s, config.target_lost_after_s
            if not signs.seen:
                limit_s = max(limit_s, _FIRST_IMAGE_S)
        elif trouble is Trouble.ENVELOPE:
            limit_s = float("inf")  # what was measured until then stands
        if not stops and lasted_s <= limit_s:
            return None
        if trouble is Trouble.TARGET_LOST:
            return Verdict(RigState.STOPPING, text, Ending.TARGET_LOST)
        if trouble is Trouble.NO_IMAGE:
            error: RigError = DeviceTimeoutError(f"the camera delivers nothing: {text}")
            return Verdict(RigState.STOPPING, text, Ending.DEVICE_FAILURE, error)
        if trouble is Trouble.STALE_STATE:
            silent = DeviceTimeoutError(f"the arm went silent: {text}")
            return Verdict(RigState.STOPPING, text, Ending.DEVICE_FAILURE, silent)
        held = "" if stops else f", for {lasted_s:.1f} s"
        error = SafetyError(f"{text}{held} (safety.reactions.{trouble.value})")
        return Verdict(RigState.STOPPING, text, Ending.SAFETY_STOP, error)
