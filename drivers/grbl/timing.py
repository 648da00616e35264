"""How late and how slow a gantry driven by jogs honestly is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.controller import Controller
from drivers.grbl.settings import GrblSettings

FloatArray = NDArray[np.float64]

# The firmware prepares ten segments of 10 ms: from leaving the planner to the motors it takes
# 55 to 95 ms, measured. The claim is the slow end.
_PREPARED_S = 0.095
_PREPARED_STD_S = 0.040 / 12.0**0.5
_PHASE_45_DEG = 0.125  # of a period
_STAMP_FLOOR_S = 0.0003
_SEGMENT_S = 0.010  # of the firmware's, measured
_RIPPLE = (1.0 / 6.0) ** 0.5  # of a number of steps rounded at both ends of a segment


@dataclass(frozen=True, slots=True)
class GrblTiming:
    """Delays of a connected gantry, for records, gains and uncertainties."""

    round_trip_s: float  # status request to answer, median at rest
    round_trip_max_s: float
    segment_s: float
    lookahead_s: float
    command_delay_s: float  # from a command to the motion it causes
    command_delay_std_s: float
    command_delay_measured: bool  # by the self-test or on the first motion; else computed
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
        """Standard deviation of a measured slide velocity."""
        step_m, speed, change = np.array([self.position_step_m, speed_m_s, acceleration_m_s2])
        return float(rate_std(step_m, speed, change, self.stamp_std_s, self.twist_window_s))


def rate_std(
    step: FloatArray,
    rate: FloatArray,
    acceleration: FloatArray,
    stamp_std_s: float,
    window_s: float,
) -> FloatArray:
    """Standard deviations of rates measured as slopes of positions over a window, elementwise.

    Steps and stamp errors at both ends of the window, and what the mean over the window hides:
    a rate that changes inside it, and the ripple of a firmware that makes whole steps in each
    of its segments. In the units of ``step``, per second.
    """
    end = np.hypot(step / np.sqrt(12.0), rate * stamp_std_s)
    hidden = np.abs(acceleration) * window_s / np.sqrt(12.0)
    steps = np.abs(rate) * _SEGMENT_S / step  # in a segment
    ripple = step / _SEGMENT_S * np.minimum(np.sqrt(steps), _RIPPLE)
    std: FloatArray = np.sqrt(2.0 * (end / window_s) ** 2 + hidden**2 + ripple**2)
    return std


def rate_spectrum(
    step: FloatArray,
    rate: FloatArray,
    acceleration: FloatArray,
    stamp_std_s: float,
    window_s: float,
) -> FloatArray:
    """Spectral densities of such rates' errors, elementwise, in the units of ``step`` squared, / s.

    What a rate is wrong by inside a window is made up for in the next: integrated, rates are the
    positions again, wrong at both ends by steps, stamps and what a mean over the window cuts off
    a bend. As a random walk that is as wrong over one window it is too wide for long stretches,
    and about right from image to image.
    """
    bend = acceleration * window_s**2 / 24.0
    end2 = step**2 / 12.0 + (rate * stamp_std_s) ** 2 + bend**2
    density: FloatArray = 2.0 * end2 / window_s
    return density


def stamp_std_s(controller: Controller) -> float:
    """Standard deviation of a report's instant, from the round trips measured at start-up.

    A late thread or an occupied line shifts stamps by about the spread of round trips.
    """
    return float(np.std(controller.round_trips_s)) + _STAMP_FLOOR_S


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
        command_delay_std_s=_PREPARED_STD_S,
        command_delay_measured=False,
        twist_window_s=settings.twist_window_s,
        state_age_s=0.5 * settings.twist_window_s + median_s,
        state_age_max_s=0.5 * settings.twist_window_s + float(trips.max()) + 0.05 + period_s,
        stamp_std_s=stamp_std_s(controller),
        position_step_m=1e-3 / float(np.min(controller.steps_per_unit[:3])),
    )
