"""What the simulated rig's configuration refuses, and that it names the key."""

import pytest
from pydantic import ValidationError

from sim_backend.clock import SimulatedClock
from sim_backend.config import CameraConfig, SimConfig
from sim_backend.lens import lens_of
from sim_backend.rig import SimulatedRig


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"sphere": {"radius_m": -0.01}}, "sphere.radius_m"),
        ({"sphere": {"radius_m": 0.0}}, "sphere.radius_m"),
        ({"sphere": {"radius_m": 0.3}}, "sphere.radius_m"),
        ({"sphere": {"radius_m": float("nan")}}, "sphere.radius_m"),
        ({"cylinder": {"radius_m": 5.0}}, "cylinder.radius_m"),
        ({"cylinder": {"direction": (0, 0, 0)}}, "cylinder.direction"),
        ({"sphere": {"position_m": (0, 0, 0.01)}}, "sphere.position_m"),
        ({"camera": {"latency_s": -0.01}}, "camera.latency_s"),
        ({"camera": {"noise_grey": -1}}, "camera.noise_grey"),
        ({"camera": {"drop_probability": 1.0}}, "camera.drop_probability"),
        ({"camera": {"exposure_s": 0.05}}, "camera.exposure_s"),
        ({"camera": {"row_time_s": 0.001}}, "camera.row_time_s"),
        ({"camera": {"rate_hz": 0}}, "camera.rate_hz"),
        ({"background": {"low_grey": 90, "high_grey": 80}}, "background.high_grey"),
        ({"light": {"direction": (0, 0, 0)}}, "light.direction"),
        ({"seed": -1}, "seed"),
        ({"renderer": "vulkan"}, "renderer"),
        ({"camera": {"focal": 800}}, "camera.focal"),
        ({"camera": {"fx": 0.0}}, "camera.fx"),
        ({"camera": {"fx": 1200.0, "fy": 800.0}}, "camera.fx"),
        ({"camera": {"cx": float("inf")}}, "camera.cx"),
        ({"camera": {"stamps": "late"}}, "camera.stamps"),
        ({"T_tool_camera": (0.0, 0.0, 0.1)}, "T_tool_camera"),
        ({"T_tool_camera": (0.0, 0.0, 0.1, 0.0, 0.0, float("nan"))}, "T_tool_camera.5"),
    ],
)
def test_nonsense_is_refused_by_name(settings, key):
    with pytest.raises(ValidationError) as refusal:
        SimConfig.model_validate(settings)
    places = [".".join(map(str, e["loc"])) for e in refusal.value.errors()]
    assert key in places or key in str(refusal.value)


def test_every_key_has_a_default_and_the_configuration_is_frozen():
    config = SimConfig()
    assert (config.sphere.radius_m, config.cylinder.radius_m) == (0.019, 0.042)
    assert (config.camera.latency_s, config.camera.noise_grey) == (0.040, 2.0)
    with pytest.raises(ValidationError, match="frozen"):
        config.seed = 3


def test_focal_lengths_and_principal_point_come_one_by_one_or_by_default():
    plain = lens_of(CameraConfig())
    assert (plain.fx_px, plain.fy_px, plain.cx_px, plain.cy_px) == (800.0, 800.0, 319.5, 239.5)
    lens = lens_of(CameraConfig(focal_px=780.0, fy=790.0, cx=310.0))
    assert (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px) == (780.0, 790.0, 310.0, 239.5)


def test_one_changed_value_of_a_start_pose_leaves_the_others_at_that_targets_defaults():
    config = SimConfig.model_validate({"sphere": {"start": {"tilt_y_deg": -32.0}}})
    assert config.sphere.start.tilt_y_deg == -32.0
    assert config.sphere.start.distance_m == SimConfig().sphere.start.distance_m


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sphere": {"position_m": (3.0, 0.0, 0.3)}}, "sphere.start is out of the gantry's reach"),
        ({"camera": {"distortion": (-3.0, 0, 0, 0, 0)}}, "camera.distortion"),
    ],
)
def test_a_rig_that_cannot_be_built_is_a_config_error(settings, words):
    config = SimConfig.model_validate({"renderer": "raster", **settings})
    with pytest.raises(ValueError, match=words):
        SimulatedRig(config, "sphere", SimulatedClock())
