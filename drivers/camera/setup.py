"""Sets a device's mode and controls in the order that works, and reads back what it made of it.

Drivers accept a value and then do something else, so what a setter returns proves nothing:
only what is read back after everything was set counts.
"""

from dataclasses import dataclass

from drivers.camera.device import ControlName, ControlPort, Mode, VideoDevice
from drivers.camera.settings import CameraControls, CameraSettings, RequestName
from drivers.errors import ConnectError

_EXPOSURE_UNITS_PER_MS = 10  # V4L2 counts exposure in 100 µs
_MANUAL_EXPOSURE = 1
_TIME_IS_SET = (None, 1, 2)  # no automatic at all, manual, shutter priority
_POWER_LINE = {"off": 0, "50hz": 1, "60hz": 2, "auto": 3}


@dataclass(frozen=True, slots=True)
class Request:
    """One control to set, after the automatic that would override it was switched off."""

    name: RequestName
    control: ControlName
    value: int
    automatic: ControlName | None = None
    manual_value: int = 0


@dataclass(frozen=True, slots=True)
class SetUp:
    """What a device was brought to."""

    mode: Mode
    exposure_s: float | None  # None where the device does not tell or decides itself
    warnings: tuple[str, ...]


def control_requests(controls: CameraControls) -> list[Request]:
    """The controls to set, in the order in which they take effect."""
    out: list[Request] = []
    if controls.exposure_ms is not None:
        units = max(1, round(controls.exposure_ms * _EXPOSURE_UNITS_PER_MS))
        out.append(Request("exposure", "exposure", units, "auto_exposure", _MANUAL_EXPOSURE))
    if controls.focus is not None:
        out.append(Request("focus", "focus", controls.focus, "auto_focus"))
    if controls.gain is not None:
        out.append(Request("gain", "gain", controls.gain, "auto_gain"))
    if controls.white_balance_k is not None:
        kelvin = controls.white_balance_k
        out.append(Request("white_balance", "white_balance", kelvin, "auto_white_balance"))
    if controls.power_line is not None:
        out.append(Request("power_line", "power_line", _POWER_LINE[controls.power_line]))
    return out


def set_up(device: VideoDevice, settings: CameraSettings, where: str) -> SetUp:
    """Set mode and controls; raises ConnectError that lists every request that did not hold.

    Requests named in ``settings.optional`` become warnings instead.
    """
    requested = Mode(settings.width, settings.height, settings.rate_hz, settings.fourcc)
    actual = device.set_mode(requested, settings.buffers)
    misses = mode_misses(requested, actual, settings.rate_tolerance)
    misses += _control_misses(device.controls, control_requests(settings.controls))
    return SetUp(
        mode=actual,
        exposure_s=_exposure_s(device.controls),
        warnings=errors_or_warnings(misses, settings, where),
    )


def _exposure_s(controls: ControlPort) -> float | None:
    """What the control says, unless an automatic decides: then it says what was set last."""
    exposure = controls.read("exposure")
    if exposure is None or controls.read("auto_exposure") not in _TIME_IS_SET:
        return None
    return exposure * 1e-3 / _EXPOSURE_UNITS_PER_MS


def errors_or_warnings(
    misses: list[tuple[RequestName, str]], settings: CameraSettings, where: str
) -> tuple[str, ...]:
    """The misses as warnings; raises ConnectError for those not marked optional."""
    errors = [text for name, text in misses if name not in settings.optional]
    if errors:
        raise ConnectError(
            f"camera {where} does not do what was asked: {'; '.join(errors)}. "
            "Ask for what it offers (rig camera list) or mark the request as optional"
        )
    return tuple(text for _, text in misses)


def mode_misses(
    requested: Mode, actual: Mode, rate_tolerance: float
) -> list[tuple[RequestName, str]]:
    """What of ``requested`` did not hold, by name and in words."""
    out: list[tuple[RequestName, str]] = []
    if requested.fourcc is not None and actual.fourcc != requested.fourcc:
        out.append(("fourcc", f"fourcc {requested.fourcc} requested, got {actual.fourcc}"))
    size = (requested.width, requested.height)
    if size != (None, None) and (actual.width, actual.height) != size:
        out.append(
            ("size", f"size {size[0]}x{size[1]} requested, got {actual.width}x{actual.height}")
        )
    rate = requested.rate_hz
    # What a source does not tell is measured later; what it does tell is compared at once.
    if rate is not None and actual.rate_hz and abs(actual.rate_hz - rate) > rate_tolerance * rate:
        out.append(("rate", f"rate {rate:g} fps requested, got {actual.rate_hz:g}"))
    return out


def _control_misses(
    controls: ControlPort, requests: list[Request]
) -> list[tuple[RequestName, str]]:
    refusals: dict[ControlName, str] = {}
    for request in requests:
        if request.automatic is not None and controls.read(request.automatic) is not None:
            _write(controls, request.automatic, request.manual_value, refusals)
        _write(controls, request.control, request.value, refusals)
    out: list[tuple[RequestName, str]] = []
    # Read back only when all are set: a later one may have changed an earlier one.
    for request in requests:
        wanted: list[tuple[ControlName, int]] = [(request.control, request.value)]
        if request.automatic is not None and controls.read(request.automatic) is not None:
            wanted.insert(0, (request.automatic, request.manual_value))
        for control, value in wanted:
            got = controls.read(control)
            if got != value:
                out.append((request.name, _miss(control, value, got, refusals.get(control))))
    return out


def _write(
    controls: ControlPort, name: ControlName, value: int, refusals: dict[ControlName, str]
) -> None:
    refusal = controls.write(name, value)
    if refusal is not None:
        refusals[name] = refusal


def _miss(name: ControlName, value: int, got: int | None, refusal: str | None) -> str:
    label = name.replace("_", " ")
    because = "" if refusal is None else f" ({refusal})"
    if got is None:
        return f"{label} {value} requested, but there is no such control{because}"
    if name == "exposure":
        return f"exposure {value / 10:g} ms requested, got {got / 10:g} ms{because}"
    return f"{label} {value} requested, got {got}{because}"
