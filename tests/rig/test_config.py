"""Configuration: what is accepted, what each mistake is told, and what overrides what."""

from pathlib import Path

import pytest
import yaml

from drivers.errors import ConfigError
from rig.config_load import dump_config, load_config


def error_of(*assignments: str, target: str = "sphere") -> str:
    with pytest.raises(ConfigError) as caught:
        load_config(target, None, list(assignments))  # type: ignore[arg-type]
    return str(caught.value)


def test_the_default_rig_uses_the_papers_gains_for_each_target() -> None:
    sphere, cylinder = load_config("sphere"), load_config("cylinder")
    assert sphere.estimator.gains("sphere") == (2000.0, 1.0)
    assert cylinder.estimator.gains("cylinder") == (500.0, 1.0)
    assert cylinder.motion.policy == "paper"


@pytest.mark.parametrize(
    ("assignments", "chosen"),
    [
        ((), "kalman"),
        (("estimator.radius_guess_m=0.02",), "kalman"),
        (("estimator.alpha=8000",), "observer"),
        (("estimator.damping=0.5",), "observer"),
        (("estimator.alpha=8000", "estimator.kind=kalman"), "kalman"),
        (("estimator.kind=observer",), "observer"),
        (("estimator.kind=batch",), "batch"),
    ],
)
def test_the_filter_is_the_default_and_the_observers_gains_choose_the_observer(
    assignments: tuple[str, ...], chosen: str
) -> None:
    assert load_config("sphere", None, list(assignments)).estimator.chosen == chosen


def test_gains_in_a_rig_file_choose_the_observer_too(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text("estimator: {damping: 2.0}\n")
    for target in ("sphere", "cylinder"):
        config = load_config(target, path)  # type: ignore[arg-type]
        assert config.estimator.chosen == "observer"
        assert load_config(target, path, ["estimator.kind=kalman"]).estimator.chosen == "kalman"  # type: ignore[arg-type]
    assert config.estimator.gains("cylinder") == (500.0, 2.0)


@pytest.mark.parametrize("wish", ["run.until_share=0.005", "motion.policy=information"])
def test_what_needs_the_filter_says_that_a_gain_has_chosen_the_observer(wish: str) -> None:
    message = error_of(wish, "estimator.alpha=2000")
    assert "estimator.kind=kalman" in message
    assert "estimator.alpha" in message


@pytest.mark.parametrize(
    ("assignment", "section", "key", "value"),
    [
        ("estimator.alpha=8000", "estimator", "alpha", 8000.0),
        ("estimator.alpha=8e3", "estimator", "alpha", 8000.0),
        ("estimator.damping=0.5", "estimator", "damping", 0.5),
        ("estimator.radius_guess_m=0.02", "estimator", "radius_guess_m", 0.02),
        ("motion.velocity_m_s=[0, 0.045, 0.02]", "motion", "velocity_m_s", (0.0, 0.045, 0.02)),
        ("run.until_converged=true", "run", "until_converged", True),
    ],
)
def test_set_overrides_one_key(assignment: str, section: str, key: str, value: object) -> None:
    config = load_config("sphere", None, [assignment])
    assert getattr(getattr(config, section), key) == value


def test_set_reaches_every_simulated_key_that_the_manual_names() -> None:
    config = load_config(
        "sphere",
        None,
        [
            "sim.sphere.radius_m=0.021",
            "sim.cylinder.radius_m=0.05",
            "sim.seed=9",
            "sim.camera.latency_s=0.08",
            "sim.camera.noise_grey=5",
            "sim.renderer=raster",
        ],
    )
    assert (config.sim.sphere.radius_m, config.sim.cylinder.radius_m) == (0.021, 0.05)
    assert (config.sim.seed, config.sim.renderer) == (9, "raster")
    assert (config.sim.camera.latency_s, config.sim.camera.noise_grey) == (0.08, 5.0)


def test_the_last_of_two_assignments_holds() -> None:
    assert load_config("sphere", None, ["sim.seed=1", "sim.seed=2"]).sim.seed == 2


@pytest.mark.parametrize(
    ("assignment", "unknown", "known"),
    [
        ("sim.camera.latncy_s=0.1", "sim.camera.latncy_s", "latency_s"),
        ("estimater.alpha=1", "estimater", "estimator"),
        ("estimator.gain=1", "estimator.gain", "damping"),
    ],
)
def test_an_unknown_key_lists_the_keys_of_its_level(
    assignment: str, unknown: str, known: str
) -> None:
    message = error_of(assignment)
    assert repr(unknown) in message
    assert known in message


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("sim.sphere.radius_m=-0.01", "sim.sphere.radius_m"),
        ("sim.cylinder.radius_m=0", "sim.cylinder.radius_m"),
        ("sim.sphere.radius_m=nan", "sim.sphere.radius_m"),
        ("estimator.alpha=-1", "estimator.alpha"),
        ("estimator.alpha=.inf", "estimator.alpha"),
        ("estimator.alpha=fast", "estimator.alpha"),
        ("estimator.radius_guess_m=0", "estimator.radius_guess_m"),
        ("sim.camera.latency_s=9", "sim.camera.latency_s"),
        ("sim.camera.latency_s=-0.01", "sim.camera.latency_s"),
        ("sim.camera.noise_grey=-1", "sim.camera.noise_grey"),
        ("sim.renderer=vulkan", "sim.renderer"),
        ("motion.velocity_m_s=[1, 0, 0]", "motion.velocity_m_s"),
        ("motion.velocity_m_s=[0, 0, 0]", "motion.velocity_m_s"),
        ("motion.velocity_m_s=[0.01, 0]", "motion.velocity_m_s"),
        ("run.duration_s=0", "run.duration_s"),
        ("arm.hold_s=0.001", "arm.hold_s"),
        ("sim.sphere=3", "sim.sphere"),
        ("sim.seed.deeper=3", "sim.seed"),
        ("safety.workspace_min_m=[3, 0, 0]", "workspace_min_m"),
    ],
)
def test_a_nonsense_value_is_an_error_that_names_its_key(assignment: str, key: str) -> None:
    assert key in error_of(assignment)


@pytest.mark.parametrize(
    ("assignments", "words"),
    [
        (("arm.driver=ur",), "arm.host"),
        (("arm.driver=ur", "arm.hots=x"), "host"),
        (("arm.driver=ur", "arm.host=10.0.0.1", "arm.watchdog_hz=0"), "arm.watchdog_hz = 0"),
        (("arm.driver=grbl", "arm.port=/dev/x", "arm.baud=1"), "arm.baud = 1"),
        (("camera.driver=opencv", "camera.source=0", "camera.height=3"), "width"),
        (("camera.driver=webcam",), "'webcam'"),
        (("camera.driver=webcam", "camera.source=1"), "camera"),
        (("arm.host=10.0.0.1",), "hold_s"),
    ],
)
def test_a_drivers_keys_are_checked_as_that_drivers(
    assignments: tuple[str, ...], words: str
) -> None:
    assert words in error_of(*assignments)


def test_a_driver_takes_its_own_keys() -> None:
    config = load_config("sphere", None, ["arm.driver=ur", "arm.host=10.0.0.1", "arm.hold_s=0.06"])
    assert config.arm.driver == "ur"
    assert (config.arm.host, config.arm.hold_s) == ("10.0.0.1", 0.06)


@pytest.mark.parametrize("assignment", ["sim.seed", "=3", "a..b=1", ""])
def test_a_malformed_assignment_shows_the_form(assignment: str) -> None:
    assert "a.b=value" in error_of(assignment)


def test_a_rig_file_is_checked_whole_even_for_the_other_target(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text("targets: {cylinder: {estimator: {alhpa: 3}}}")
    with pytest.raises(ConfigError, match=r"alhpa.*alpha"):
        load_config("sphere", rig)


@pytest.mark.parametrize(
    "text", ["- a list", "a: [", "targets: 3", "targets: {cube: {}}", "unknown: 1"]
)
def test_a_broken_rig_file_is_an_error_that_names_it(tmp_path: Path, text: str) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(text)
    with pytest.raises(ConfigError, match=r"rig\.yaml"):
        load_config("sphere", rig)


def test_a_missing_rig_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml"):
        load_config("sphere", tmp_path / "nowhere.yaml")


def test_the_dumped_configuration_reads_back_as_the_same(tmp_path: Path) -> None:
    config = load_config("cylinder", None, ["sim.seed=5", "estimator.alpha=700"])
    path = tmp_path / "config.yaml"
    path.write_text(dump_config(config))
    assert load_config("cylinder", path) == config
    assert "targets" not in yaml.safe_load(path.read_text())
