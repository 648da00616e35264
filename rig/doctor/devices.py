"""The rig's own camera and arm, looked at; nothing moves."""

from collections.abc import Mapping

from drivers.camera.settings import CameraSettings
from drivers.clock import Clock
from drivers.errors import ConfigError, RigError
from drivers.grbl.settings import GrblSettings
from drivers.ur.settings import UrSettings
from rig.arm_kits import Address, arm_kit
from rig.config import RigConfig
from rig.doctor.finding import Finding, Status, Value
from rig.doctor.subject import Subject

_WATCH_S = 5.0
_WATCH_QUICK_S = 2.0
_FEW = 0.02
_KEPT = (  # of the camera's report
    "width", "height", "fourcc", "measured_fps", "stamp_source", "stamp_jitter_s",
    "latency_median_s", "latency_p99_s", "longest_gap_s", "frames", "dropped", "corrupt",
)  # fmt: skip


def calibration(subject: Subject, clock: Clock) -> Finding:
    """Whether there is what a real rig has to know about its geometry, and where it is from."""
    from rig.calibrated import NotCalibratedError, calibrated

    again = f"rig calibrate --rig {subject.rig_file or 'FILE'}"
    try:
        source = calibrated(subject.config, subject.rig_file).source
    except NotCalibratedError as error:
        advice = f"{again}; looking and jogging work without, `rig run` refuses until then"
        return Finding("calibration", Status.WARN, str(error), advice, {"source": None})
    except RigError as error:
        return Finding("calibration", Status.FAIL, str(error), again)
    return Finding("calibration", Status.OK, source, "", {"source": source})


def camera(subject: Subject, clock: Clock) -> Finding:
    """Open the camera as a run would and watch it for some seconds."""
    from drivers.camera.check import check_camera
    from drivers.camera.open import open_camera
    from rig.commands.camera_text import report

    settings = subject.config.camera
    if not isinstance(settings, CameraSettings):
        return Finding("camera", Status.OK, "simulated")
    # A camera that does not come back ends the look, not the patience of whoever waits.
    settings = settings.model_copy(update={"give_up_after_s": 5.0})
    try:
        device = open_camera(settings, clock)
    except RigError as error:
        return Finding("camera", Status.FAIL, str(error), _where_to_look(str(settings.source)))
    try:
        result = check_camera(device, clock, _WATCH_QUICK_S if subject.quick else _WATCH_S)
    finally:
        device.close()
    return judge_camera(report(result), str(settings.source))


def _where_to_look(source: str) -> str:
    """What to type when a camera cannot be opened: another machine's is in no list."""
    if "://" in source:
        return f"rig camera check --source {source}"
    return "rig camera list; see camera.source"


def judge_camera(figures: Mapping[str, object], source: str) -> Finding:
    """The row of what ``rig camera check`` prints."""
    values: dict[str, Value] = {}
    for name in _KEPT:
        value = figures.get(name)
        values[name] = value if isinstance(value, bool | int | float | str) else None
    rate, latency = values["measured_fps"], values["latency_median_s"]
    parts = [f"{values['width']}x{values['height']}"]
    parts += [f"{rate:.2f} fps"] if isinstance(rate, float) else []
    parts += [f"{values['frames']} frames, {values['dropped']} dropped"]
    parts += [f"stamps: {values['stamp_source']}"]
    parts += [f"latency {latency * 1e3:.0f} ms"] if isinstance(latency, float) else []
    text, advice = ", ".join(parts), f"rig camera check --source {source}"
    warnings = figures.get("warnings") or []
    if figures["problem"] is not None:
        return Finding("camera", Status.FAIL, f"{figures['problem']} ({text})", advice, values)
    if isinstance(warnings, list) and warnings:
        text = f"{text}; {'; '.join(str(warning) for warning in warnings)}"
        return Finding("camera", Status.WARN, text, advice, values)
    frames, dropped = values["frames"], values["dropped"]
    if isinstance(frames, int) and isinstance(dropped, int) and dropped > _FEW * frames:
        advice = "end what else uses its cable or this machine's processors, then check again"
        return Finding("camera", Status.WARN, text, advice, values)
    return Finding("camera", Status.OK, text, "", values)


def arm(subject: Subject, clock: Clock) -> Finding:
    """Ask the arm how it is, as ``rig arm status`` does."""
    address = address_of(subject.config)
    if address is None:
        return Finding("arm", Status.OK, "simulated")
    name = subject.config.arm.driver
    again = f"--arm {name} " + (
        f"--port {address.port}" if address.host is None else f"--host {address.host}"
    )
    try:
        facts = arm_kit(name, address).status(clock)
    except RigError as error:
        return Finding("arm", Status.FAIL, str(error), f"rig arm status {again}")
    return judge_arm(facts, again)


def judge_arm(facts: Mapping[str, object], again: str) -> Finding:
    """The row of what ``rig arm status`` prints; ``again`` are its options."""
    names = (
        *("controller", "state", "safety", "mode", "remote_control", "speed_scaling"),
        *("round_trip_s", "command_delay_s", "bandwidth_hz"),  # of a serial line, which is slow
    )
    values: dict[str, Value] = {}
    for name in names:
        value = facts.get(name)
        if isinstance(value, bool | int | float | str):
            values[name] = value
    if facts["problem"] is not None:
        advice = f"look at the arm, then: rig arm recover {again}"
        return Finding("arm", Status.FAIL, str(facts["problem"]), advice, values)
    words = [str(values.get("controller", "")).strip()]
    words += [str(values["state"]).rstrip(".")] if "state" in values else []
    words += [f"safety {values['safety']}, {values['mode']}"] if "safety" in values else []
    trip, delay, bandwidth = (values.get(name) for name in names[-3:])
    if isinstance(trip, float) and isinstance(delay, float) and isinstance(bandwidth, float):
        words += [
            f"round trip {trip * 1e3:.0f} ms, commands act after {delay * 1e3:.0f} ms: closed "
            f"loops below {bandwidth:.1f} Hz"
        ]
    text = ", ".join(word for word in words if word)
    if values.get("remote_control") is False:
        advice = "switch the pendant to remote control: the arm refuses programs otherwise"
        return Finding("arm", Status.WARN, f"{text}, in local control", advice, values)
    if isinstance(unguarded := facts.get("unguarded"), str):
        advice = "keep it away from its joint ends and singularities by safety.workspace_*"
        return Finding("arm", Status.WARN, f"{text}, {unguarded}", advice, values)
    scaling = values.get("speed_scaling")
    if isinstance(scaling, float) and scaling < 0.995:
        text = f"{text}, speed slider at {100 * scaling:.0f} %"
        advice = "commanded speeds are scaled by it; the estimate uses the measured ones"
        return Finding("arm", Status.WARN, text, advice, values)
    return Finding("arm", Status.OK, text, "", values)


def address_of(config: RigConfig) -> Address | None:
    """Where the rig's arm is; None for a simulated one."""
    settings = config.arm
    if isinstance(settings, UrSettings):
        return Address(host=settings.host)
    if isinstance(settings, GrblSettings):
        return Address(port=settings.port, baud=settings.baud)
    if settings.driver != "sim":
        raise ConfigError(f"arm.driver = {settings.driver}: the doctor does not know this arm")
    return None
