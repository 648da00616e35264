"""How late and how slow a gantry driven by jogs honestly is."""

from dataclasses import dataclass

import numpy as np

from drivers.grbl.controller import Controller
from drivers.grbl.settings import GrblSettings

# The firmware prepares ten segments of 10 ms: from leaving the planner to the motors it takes
# 55 to 95 ms, measured. The claim is the slow end.
_PREPARED_S = 0.095
_PHASE_45_DEG = 0.125  # of a period


@dataclass(frozen=True, slots=True)
class GrblTiming:
    """Delays of a connected gantry, for records, gains and uncertainties."""

    round_trip_s: float  # status request to answer, median at rest
    round_trip_max_s: float
    segment_s: float
    lookahead_s: float
    command_delay_s: float  # from a command to the motion it causes
    command_delay_measured: bool  # by the self-test; else computed
    twist_window_s: float  # measured twists are means over this
    state_age_s: float  # of a new state when it becomes readable, typically
    state_age_max_s: float  # between states, with one report lost
    stamp_std_s: float  # of a report's instant
    position_step_m: float  # of the coarsest slide

    @property
    def bandwidth_hz(self) -> float:
        """Where the pure delay turns the phase by −45°: keep closed loops well below it."""
        return _PHASE_45_DEG / self.command_delay_s

    def velocity_std_m_s(self, speed_m_s: float, acceleration_m_s2: float = 0.0) -> float:
        """Standard deviation of a measured slide velocity.

        Steps and stamp errors at both ends of the window, and what the mean over the window
        hides when the speed changes inside it.
        """
        end_m = np.hypot(self.position_step_m / np.sqrt(12.0), speed_m_s * self.stamp_std_s)
        noise = np.sqrt(2.0) * end_m / self.twist_window_s
        hidden = abs(acceleration_m_s2) * self.twist_window_s / np.sqrt(12.0)
        return float(np.hypot(noise, hidden))


def timing_of(
    controller: Controller, settings: GrblSettings, segment_s: float, lookahead_s: float
) -> GrblTiming:
    """What follows from the settings and the round trips measured at start-up."""
    trips = np.array(controller.round_trips_s)
    median_s, period_s = float(np.median(trips)), 1.0 / settings.poll_hz
    return GrblTiming(
        round_trip_s=median_s,
        round_trip_max_s=float(trips.max()),
        segment_s=segment_s,
        lookahead_s=lookahead_s,
        command_delay_s=lookahead_s + _PREPARED_S + 0.5 * median_s,
        command_delay_measured=False,
        twist_window_s=settings.twist_window_s,
        state_age_s=0.5 * settings.twist_window_s + median_s,
        state_age_max_s=0.5 * settings.twist_window_s + float(trips.max()) + 0.05 + period_s,
        # A late thread or an occupied line shifts stamps by about the spread of round trips.
        stamp_std_s=float(np.std(trips)) + 0.0003,
        position_step_m=1e-3 / float(np.min(controller.steps_per_unit[:3])),
    )
