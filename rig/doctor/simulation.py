"""What needs no device: the renderer, the image kernels, the simulated rig."""

from drivers.clock import Clock
from drivers.errors import RigError
from rig.doctor.finding import Finding, Status, Value
from rig.doctor.subject import Subject

_STEPS = 9
_COMPILED_S = 10.0


def renderer(subject: Subject, clock: Clock) -> Finding:
    """Which renderer a simulated camera would get."""
    from sim_backend.gl_context import why_no_gl
    from sim_backend.render_choice import choose_renderer

    wanted = subject.config.sim.renderer
    try:
        taken = choose_renderer(wanted)
    except RigError as error:
        return Finding("renderer", Status.FAIL, str(error), "--set sim.renderer=raster")
    return judge_renderer(wanted, taken, why_no_gl() if wanted == "auto" else "")


def judge_renderer(wanted: str, taken: str, why_no_gl: str) -> Finding:
    """No OpenGL is no fault: the other renderer needs none."""
    why = " (no OpenGL here)" if why_no_gl else ""
    values = {"wanted": wanted, "taken": taken, "why_no_gl": why_no_gl or None}
    return Finding("renderer", Status.OK, f"{taken}{why}", "", values)


def image_kernels(subject: Subject, clock: Clock) -> Finding:
    """Compile the kernels that measure images, or take them from where they were kept."""
    from estimator.image.intrinsics import Intrinsics
    from estimator.image.tracker import warm_up

    start_s = clock.now_s()
    warm_up("sphere", Intrinsics(800.0, 800.0, 319.5, 239.5), subject.config.camera.method)
    took_s = clock.now_s() - start_s
    text = f"ready after {took_s:.1f} s" + (": compiled anew" if took_s > _COMPILED_S else "")
    return Finding("image_kernels", Status.OK, text, "", {"ready_s": took_s})


def simulated_rig(subject: Subject, clock: Clock) -> Finding:
    """Build the simulated rig, take pictures, and measure the ball in them."""
    import numpy as np

    from estimator.image.intrinsics import Intrinsics
    from estimator.image.tracker import TargetTracker, warm_up
    from sim_backend.clock import SimulatedClock
    from sim_backend.rig import SimulatedRig

    rig = SimulatedRig(subject.config.sim, "sphere", SimulatedClock())
    try:
        intrinsics = Intrinsics(*rig.intrinsics)
        method = subject.config.camera.method
        warm_up("sphere", intrinsics, method)
        tracker = TargetTracker("sphere", intrinsics, method)
        costs_s, reason = [], "no picture came"
        for _ in range(_STEPS):
            frame = rig.camera.read(timeout_s=1.0)
            if frame is None:
                break
            start_s = clock.now_s()
            measurement = tracker.measure(frame.image)
            costs_s.append(clock.now_s() - start_s)  # the first one searches, the others follow
            reason = "" if measurement.feature is not None else str(measurement.reason)
    finally:
        rig.close()
    return judge_simulation(rig.renderer_name, reason, float(np.median(costs_s[1:] or [0.0])))


def judge_simulation(renderer_name: str, reason: str, cost_s: float) -> Finding:
    """The ball has to be seen."""
    values: dict[str, Value] = {"renderer": renderer_name, "measure_s": cost_s}
    if reason:
        advice = "look at what is set below sim: in the rig file"
        return Finding("simulated_rig", Status.FAIL, f"no ball seen: {reason}", advice, values)
    text = f"works; an image is measured in {cost_s * 1e3:.1f} ms"
    return Finding("simulated_rig", Status.OK, text, "", values)
