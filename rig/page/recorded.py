"""A past run on the page: its states along a time slider."""

from bisect import bisect_right

import numpy as np
import viser
from numpy.typing import NDArray

from drivers.clock import Clock
from rig.outlined import outlined
from rig.page.panel import Panel
from rig.page.scene import Scene
from rig.page.state import PageState, with_arm, with_estimate, with_feature
from rig.recorded.record import RunRecord

FloatArray = NDArray[np.float64]

_EVERY_S = 0.05
_SPEEDS = ("0.25 ×", "1 ×", "4 ×")


class RecordedStates:
    """What the page showed, or would have shown, at any time of a run."""

    def __init__(self, record: RunRecord) -> None:
        self._record = record
        data = record.data
        self._arm_s = [state.t_s for state in data.arm_states]
        self._update_s = [update.t_s for update in data.updates]
        self._tick_s = [tick.t_s for tick in record.ticks]
        self._command_s = [command.t_s for command in record.commands]
        self._frame_s = [frame.handled_s for frame in record.frames]
        self._lost = np.cumsum([frame.reason != "" for frame in record.frames])
        self._picture_s = [picture.t_s for picture in record.pictures]
        self._speed_m_s = np.linalg.norm(data.arm_track().twist_camera[:, :3], axis=1)
        starts = [times[0] for times in (self._arm_s, self._tick_s) if times]
        event_s = [event.t_s for event in record.events]
        ends = [times[-1] for times in (self._arm_s, self._tick_s, event_s) if times]
        self._start_s = min(starts, default=record.start_s)
        self.duration_s = max(ends, default=record.start_s) - self._start_s

    def at(self, elapsed_s: float) -> PageState:
        """The state ``elapsed_s`` after the run's beginning."""
        t_s = self._start_s + elapsed_s
        record, data = self._record, self._record.data
        frame, tick = bisect_right(self._frame_s, t_s), bisect_right(self._tick_s, t_s)
        command = bisect_right(self._command_s, t_s)
        arm, update = bisect_right(self._arm_s, t_s), bisect_right(self._update_s, t_s)
        before = [event for event in record.events if event.t_s <= t_s]
        states = [event for event in before if event.name.startswith("state ")]
        targets = [event for event in before if event.name.startswith("target ")]
        state = PageState(
            elapsed_s=elapsed_s,
            state=_text(states[-1].name, states[-1].detail) if states else "starting",
            target_state=_text(targets[-1].name, targets[-1].detail) if targets else "searching",
            frames=frame,
            frames_lost=int(self._lost[frame - 1]) if frame else 0,
            ticks=tick,
            overruns=record.ticks[tick - 1].overruns if tick else 0,
            late_s=record.ticks[tick - 1].late_s if tick else 0.0,
            speed_m_s=float(self._speed_m_s[arm - 1]) if arm else 0.0,
            limited_by=record.commands[command - 1].reasons if command else (),
        )
        picture = self.picture_at(elapsed_s)
        if picture is not None:
            state = with_feature(state, record.pictures[picture].feature)
        state = with_arm(state, data.arm_states[arm - 1] if arm else None)
        return with_estimate(state, data.updates[update - 1] if update else None, None, 0.0)

    def picture_at(self, elapsed_s: float) -> int | None:
        """Which of the record's pictures to show; None of a run that kept none."""
        if not self._picture_s:
            return None
        return max(bisect_right(self._picture_s, self._start_s + elapsed_s) - 1, 0)


class Player:
    """The page of one past run."""

    def __init__(self, server: viser.ViserServer, record: RunRecord) -> None:
        self._record = record
        self._states = RecordedStates(record)
        self._server = server
        end_s = max(self._states.duration_s, _EVERY_S)
        self._time = server.gui.add_slider("t [s]", 0.0, end_s, _EVERY_S, 0.0)
        self._playing = server.gui.add_checkbox("play", initial_value=True)
        self._speed = server.gui.add_dropdown("speed", _SPEEDS, initial_value=_SPEEDS[1])
        self._panel = Panel(server, None)
        self._scene = Scene(server, record.setup, record.config.safety)
        self._shown_s: float | None = None
        self._picture: int | None = None

    def run(self, clock: Clock) -> None:
        """Play and follow the slider for ever."""
        next_s = clock.now_s()
        while True:
            self.step()
            next_s = max(next_s + _EVERY_S, clock.now_s())
            clock.sleep_until(next_s)

    def step(self) -> None:
        """One twentieth of a second."""
        at_s = float(self._time.value)
        if self._playing.value:
            at_s = min(at_s + _EVERY_S * float(self._speed.value.split()[0]), self._time.max)
            # mypy does not see viser's setters.
            self._time.value = at_s  # type: ignore[misc]
            self._playing.value = at_s < self._time.max  # type: ignore[misc]
        if at_s == self._shown_s:
            return
        if self._shown_s is not None and at_s < self._shown_s:
            self._scene.restart()
        self._shown_s = at_s
        with self._server.atomic():
            state = self._states.at(at_s)
            self._panel.update(state)
            self._scene.update(state)
        self._show_picture(at_s)

    def _show_picture(self, at_s: float) -> None:
        number = self._states.picture_at(at_s)
        if number is None or number == self._picture:
            return
        self._picture = number
        record = self._record
        picture = record.pictures[number]
        image = outlined(picture.load(), picture.feature, record.setup.intrinsics)
        caption = f"image {number + 1} of {len(record.pictures)}"
        self._panel.show_image(image, f"{caption}, t = {picture.t_s - record.start_s:.2f} s")


def _text(name: str, detail: str) -> str:
    """The event's words without what kind of event it is."""
    words = name.partition(" ")[2]
    return f"{words}: {detail}" if detail else words
