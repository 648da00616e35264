"""The run directory: what is in it, and what is refused."""

from collections import Counter
from pathlib import Path

import pytest

from drivers.errors import ConfigError
from rig.config_load import load_config
from rig.records import make_figures_dir, make_run_dir, write_summary
from tests.rig.fakes import make_bench
from tests.rig.log_lines import log_lines


def test_the_log_holds_every_sample_of_every_kind(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=1"])
    bench.run()
    lines = log_lines(tmp_path)
    kinds = Counter(line["kind"] for line in lines)
    assert set(kinds) == {"arm", "frame", "update", "estimate", "command", "event", "tick"}
    assert kinds["arm"] == len(bench.data.arm_states)
    assert kinds["frame"] == bench.data.frames
    assert kinds["update"] == len(bench.data.updates)
    assert kinds["command"] == len(bench.arm.commands)
    assert all(isinstance(line["t_s"], float) for line in lines)
    command = next(line for line in lines if line["kind"] == "command")
    assert {"commanded", "allowed", "measured", "reasons"} <= set(command)


def test_the_stored_configuration_repeats_the_run(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["estimator.alpha=4000"])
    assert load_config("sphere", tmp_path / "config.yaml") == bench.config


def test_a_directory_that_holds_a_run_is_not_written_over(tmp_path: Path) -> None:
    run_dir = make_run_dir(tmp_path / "deep" / "run", "sphere")
    write_summary(run_dir, {"radius_m": 0.019})
    with pytest.raises(ConfigError, match="already holds a run"):
        make_run_dir(run_dir, "sphere")


def test_a_directory_whose_run_never_began_can_be_used_again(tmp_path: Path) -> None:
    assert make_run_dir(tmp_path / "run", "sphere") == make_run_dir(tmp_path / "run", "sphere")


def test_an_existing_empty_directory_is_used(tmp_path: Path) -> None:
    assert make_run_dir(tmp_path, "sphere") == tmp_path


def test_default_directories_never_collide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert len({make_run_dir(None, "sphere") for _ in range(3)}) == 3
    assert len({make_figures_dir(None, "fig3") for _ in range(3)}) == 3


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="file"):
        make_run_dir(tmp_path / "file" / "run", "sphere")
    with pytest.raises(ConfigError, match="file"):
        make_figures_dir(tmp_path / "file" / "figures", "all")
