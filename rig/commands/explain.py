"""What is said on stderr at the end of a run."""

from typing import TYPE_CHECKING

from rig.commands.options import warn

if TYPE_CHECKING:
    from rig.config import RigConfig
    from rig.run import RunResult

# Below this the radius is the observer's, above it is still partly the first guess.
_SETTLED = 0.01


def explain(result: "RunResult", config: "RigConfig") -> None:
    """Say on stderr what a number alone would hide."""
    outcome = result.outcome
    if outcome.error is not None:
        warn(f"error: {outcome.error}")
    elif result.summary["radius_m"] is None:
        warn(f"no radius: {outcome.ending.value}; {outcome.target_state}")
    elif config.estimator.states_variance:
        _explain_interval(result)
    elif config.estimator.chosen == "observer" and outcome.remaining_fraction > _SETTLED:
        warn(
            f"not settled: about {100 * outcome.remaining_fraction:.0f} % of the first guess's "
            "error is left; run longer, faster or with a larger estimator.alpha"
        )
    _explain_servo(result)
    lost = result.summary["images_not_recorded"]
    if lost:
        warn(
            f"warning: {lost} images are not in the log, writing was too slow: try log.images=jpeg"
        )
    if not outcome.at_rest:
        warn("warning: the arm was not seen at rest after its stop; check it before coming near")


def _explain_servo(result: "RunResult") -> None:
    """Say that a servo has not got where it should."""
    from rig.outcome import Ending

    off_px, off_m = (result.summary[f"servo_{key}"] for key in ("error_px", "distance_error_m"))
    if isinstance(off_px, float) and result.outcome.ending is Ending.TIME:
        distance = f"{1e3 * off_m:+.1f} mm" if isinstance(off_m, float) else "an unknown distance"
        held = result.outcome.last_hold
        warn(
            f"not arrived: the target is {off_px:.1f} px and {distance} from its wanted place"
            + (f"; the motion was held: {held}" if held else "; run longer, or see motion.servo")
        )


def _explain_interval(result: "RunResult") -> None:
    """Say what is wrong with an estimate that comes with its uncertainty."""
    for doubt in result.outcome.data.doubts():
        warn(f"doubtful: {doubt}")
    for state in result.outcome.data.extra_states():
        if not state.observable:
            warn(
                f"{state.name} is not observable in this run: its value is little more than the "
                "assumption; move at changing speed, or turn the camera against its motion"
            )
    share = result.outcome.remaining_fraction
    if result.summary["radius_std_m"] is None:
        warn(
            "uncertain: this motion did not tell the radius, which is little more than the first "
            "guess; move further, or faster, across the line of sight"
        )
    elif share > _SETTLED:
        warn(f"uncertain: the 95 % interval of the radius is ± {100 * share:.0f} %; move further")
