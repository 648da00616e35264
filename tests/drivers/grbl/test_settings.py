from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

from drivers.grbl.settings import AxisSettings, GrblSettings, WristSettings, standard_axes
from drivers.grbl.words import alarm_words, door_words, error_words, pin_words
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import WRIST, axes_of

CONFIGS = Path(__file__).parents[3] / "configs"


def refused(message: str, **keys: object) -> None:
    with pytest.raises(ValidationError, match=message):
        GrblSettings.model_validate({"port": "x", **keys})


def test_all_three_slides_are_needed() -> None:
    refused("slides x, y and z are all needed", axes=standard_axes(2))


def test_an_axis_moves_one_joint() -> None:
    axes = (*standard_axes(3), AxisSettings(letter="A", joint="z"))
    refused("a joint appears twice", axes=axes)


def test_an_empty_range_is_refused() -> None:
    with pytest.raises(ValidationError, match="mpos_min must lie below"):
        AxisSettings(letter="X", joint="x", mpos_min=1.0, mpos_max=1.0)


def test_a_wrist_axis_is_a_unit_vector() -> None:
    with pytest.raises(ValidationError, match="not a unit vector"):
        WristSettings(roll_axis=(1.0, 1.0, 0.0))


def test_an_unknown_key_is_refused() -> None:
    refused("Extra inputs are not permitted", speed=3)


@pytest.mark.parametrize("name", ["gantry", "loopback_gantry"])
def test_the_configurations_that_come_along_are_valid(name: str) -> None:
    arm = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text(encoding="utf-8"))["arm"]
    assert arm.pop("driver") == "grbl"
    assert 0.0 < arm.pop("hold_s") <= 0.2
    GrblSettings.model_validate(arm)


def test_the_loopback_configuration_describes_the_emulated_gantry() -> None:
    text = (CONFIGS / "loopback_gantry.yaml").read_text(encoding="utf-8")
    arm = yaml.safe_load(text)["arm"]
    settings = GrblSettings.model_validate(
        {key: value for key, value in arm.items() if key not in ("driver", "hold_s")}
    )
    machine = Machine()
    assert settings.axes == axes_of(machine)
    assert settings.wrist == WRIST
    assert settings.baud == machine.baud


def test_numbers_in_words() -> None:
    assert "soft limits" in error_words(15)
    assert error_words(999).startswith("error:999")
    assert "limit switch" in alarm_words(1)
    assert "power-up" in alarm_words(None)
    assert "open" in door_words(1)
    assert pin_words("XE") == "limit switch X, emergency stop"
