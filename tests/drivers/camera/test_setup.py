"""Only what reads back as requested counts as set."""

import pytest

from drivers.camera.device import ControlName, Mode
from drivers.camera.settings import CameraControls, CameraSettings
from drivers.camera.setup import SetUp, set_up
from drivers.errors import ConnectError
from sim_backend.clock import SimulatedClock
from tests.drivers.camera.scripted import Script

ALL_AUTOMATIC: dict[ControlName, int] = {
    "auto_exposure": 3,
    "exposure": 157,
    "auto_focus": 1,
    "focus": 0,
    "auto_gain": 1,
    "gain": 20,
    "auto_white_balance": 1,
    "white_balance": 4600,
    "power_line": 1,
}
EVERYTHING = CameraControls(
    exposure_ms=4.0, gain=60, focus=40, white_balance_k=5000, power_line="60hz"
)


def run(script: Script, **settings: object) -> SetUp:
    return set_up(script.open(), CameraSettings(**settings), "cam")  # type: ignore[arg-type]


def test_automatics_are_switched_off_before_what_they_would_override() -> None:
    script = Script(SimulatedClock(), controls=dict(ALL_AUTOMATIC))
    result = run(script, controls=EVERYTHING)
    assert script.written == [
        ("auto_exposure", 1),
        ("exposure", 40),
        ("auto_focus", 0),
        ("focus", 40),
        ("auto_gain", 0),
        ("gain", 60),
        ("auto_white_balance", 0),
        ("white_balance", 5000),
        ("power_line", 2),
    ]
    assert result.warnings == ()
    assert result.exposure_s == pytest.approx(0.004)


def test_a_control_left_alone_is_not_written() -> None:
    script = Script(SimulatedClock(), controls=dict(ALL_AUTOMATIC))
    run(script)
    assert script.written == []


def test_a_camera_without_the_automatic_needs_none_switched_off() -> None:
    script = Script(SimulatedClock(), controls={"exposure": 10})
    result = run(script, controls=CameraControls(exposure_ms=2.0))
    assert result.exposure_s == pytest.approx(0.002)


@pytest.mark.parametrize(("menu", "told_s"), [(0, None), (1, 0.0157), (2, 0.0157), (3, None)])
def test_an_exposure_that_an_automatic_decides_is_not_known(
    menu: int, told_s: float | None
) -> None:
    script = Script(SimulatedClock(), controls={"auto_exposure": menu, "exposure": 157})
    assert run(script).exposure_s == told_s


def test_every_request_that_did_not_hold_is_named_with_what_it_became() -> None:
    script = Script(
        SimulatedClock(),
        controls=dict(ALL_AUTOMATIC),
        hold=lambda name, value: {"exposure": 2047, "focus": 45, "auto_gain": 1}.get(name, value),
    )
    with pytest.raises(ConnectError) as raised:
        run(script, controls=EVERYTHING)
    message = str(raised.value)
    assert "exposure 4 ms requested, got 204.7 ms" in message
    assert "focus 40 requested, got 45" in message
    assert "auto gain 0 requested, got 1" in message
    assert "white balance" not in message


def test_a_value_changed_by_a_later_one_is_noticed() -> None:
    script = Script(SimulatedClock(), controls=dict(ALL_AUTOMATIC))

    def focus_resets_exposure(name: str, value: int) -> int:
        if name == "focus":
            script.controls["exposure"] = 157
        return value

    script.hold = focus_resets_exposure
    with pytest.raises(ConnectError, match=r"exposure 4 ms requested, got 15\.7 ms"):
        run(script, controls=EVERYTHING)


def test_a_missing_control_is_an_error_or_where_optional_a_warning() -> None:
    script = Script(SimulatedClock())
    with pytest.raises(ConnectError, match="focus 40 requested, but there is no such control"):
        run(script, controls=CameraControls(focus=40))
    result = run(script, controls=CameraControls(focus=40), optional=("focus",))
    assert len(result.warnings) == 1
    assert "focus 40" in result.warnings[0]


@pytest.mark.parametrize(
    ("request_", "actual", "words"),
    [
        ({"fourcc": "MJPG"}, Mode(640, 480, 30.0, "YUYV"), "fourcc MJPG requested, got YUYV"),
        (
            {"width": 1280, "height": 720},
            Mode(640, 480, 30.0, "YUYV"),
            "size 1280x720 requested, got 640x480",
        ),
        ({"rate_hz": 30.0}, Mode(640, 480, 25.0, "YUYV"), "rate 30 fps requested, got 25"),
    ],
)
def test_a_mode_that_did_not_hold_names_requested_and_actual(
    request_: dict[str, object], actual: Mode, words: str
) -> None:
    with pytest.raises(ConnectError, match=words):
        run(Script(SimulatedClock(), mode=actual), **request_)


def test_what_was_not_requested_is_taken_as_it_is() -> None:
    mode = Mode(321, 123, 7.0, "UYVY")
    assert run(Script(SimulatedClock(), mode=mode)).mode == mode


def test_a_rate_within_the_tolerance_holds() -> None:
    mode = Mode(640, 480, 29.97, "YUYV")
    assert run(Script(SimulatedClock(), mode=mode), rate_hz=30.0).warnings == ()
