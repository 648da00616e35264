"""A replay says what the run said, and answers "what if" by the live code."""

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from drivers.errors import ConfigError
from rig.config import TargetKind
from rig.replay.compare import first_difference
from rig.replay.engine import replay
from rig.replay.recording import open_recording
from rig.summary import JSON_KEYS
from tests.rig.command_line import rig
from tests.rig.fakes import RADIUS_M, Bench, make_bench

# The wall's time, and where the data are, are the replay's own.
OWN = {"wall_s", "run_dir"}


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """A run of three seconds that has ended, its images not recorded."""
    bench = make_bench(tmp_path_factory.mktemp("run"), ["run.duration_s=3"])
    bench.run()
    return bench


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_unchanged_settings_repeat_a_run_to_the_bit(target: TargetKind, tmp_path: Path) -> None:
    """From pixels on: late, jittering and missing images included."""
    settings = ["sim.renderer=raster", "sim.camera.drop_probability=0.1", "estimator.alpha=6000"]
    options = [part for one in settings for part in ("--set", one)]
    arguments = ["--target", target, "--duration", "1", "--json", "--out", str(tmp_path)]
    live = rig("run", *arguments, *options)
    assert live.exit_code == 0, live.stderr
    for source in ("features", "images"):
        again = rig("replay", str(tmp_path), "--json", "--from", source)
        assert again.exit_code == 0, again.stderr
        assert "identical to the run" in again.stderr
        found, expected = json.loads(again.stdout), json.loads(live.stdout)
        assert tuple(found) == JSON_KEYS
        assert {k: v for k, v in found.items() if k not in OWN} == {
            k: v for k, v in expected.items() if k not in OWN
        }


def test_the_comparison_sees_the_smallest_difference(bench: Bench) -> None:
    done = replay(open_recording(bench.run_dir))
    assert first_difference(done.recorded, done.replayed) == ""
    assert len(done.recorded.updates) == len(bench.data.updates)
    assert len(done.recorded.predictions) > 250
    changed = done.recorded.updates[40].s
    changed[2] = np.nextafter(changed[2], np.inf)
    assert first_difference(done.recorded, done.replayed).startswith("update 40 ")


def test_a_log_cut_off_amid_a_tick_may_lack_what_that_tick_said(tmp_path: Path) -> None:
    make_bench(tmp_path, ["run.duration_s=1"]).run()
    done = replay(open_recording(tmp_path))
    del done.recorded.updates[-1:], done.recorded.predictions[-1:]
    assert first_difference(done.recorded, done.replayed, cut_off=True) == ""
    assert "recorded" in first_difference(done.recorded, done.replayed)
    del done.recorded.updates[-2:]
    assert "recorded" in first_difference(done.recorded, done.replayed, cut_off=True)


def test_another_gain_gives_what_a_run_with_it_would_have_given(
    bench: Bench, tmp_path: Path
) -> None:
    """A second run can tell: the arm moves all but alike under both gains."""
    straight = ["run.duration_s=2"]
    runs = {}
    for alpha in (2000, 6000):
        one = tmp_path / str(alpha)
        one.mkdir()
        runs[alpha] = make_bench(one, [*straight, f"estimator.alpha={alpha}"])
        runs[alpha].run()
    done = replay(open_recording(tmp_path / "2000"), ["estimator.alpha=6000"])
    chi = [update.chi for update in done.replayed.updates]
    expected = [update.chi for update in runs[6000].data.updates]
    np.testing.assert_allclose(chi, expected, rtol=3e-4)
    assert abs(chi[-1] - runs[2000].data.updates[-1].chi) > 1.0


def test_an_estimator_that_states_its_uncertainty_is_repeated_with_it(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=1", "estimator.kind=kalman"])
    bench.run()
    done = replay(open_recording(tmp_path))
    assert first_difference(done.recorded, done.replayed) == ""
    recorded, live = done.recorded.updates[-1], bench.data.updates[-1]
    assert recorded.covariance is not None and live.covariance is not None
    np.testing.assert_array_equal(recorded.covariance, live.covariance)
    recorded.covariance[0, 0] *= 1.0 + 1e-15
    assert "update" in first_difference(done.recorded, done.replayed)


def test_another_estimator_answers_on_the_same_recording(bench: Bench) -> None:
    done = replay(open_recording(bench.run_dir), ["estimator.kind=kalman"])
    assert done.summary["radius_std_m"] is not None
    assert done.summary["radius_m"] == pytest.approx(RADIUS_M, rel=1e-3)
    assert done.summary["radius_m"] != bench.data.updates[-1].radius_m


def test_a_wrong_latency_shows_in_the_radius(bench: Bench) -> None:
    radii = [
        replay(open_recording(bench.run_dir), settings).summary["radius_m"]
        for settings in ([], ["calibration.latency_s=0.05"])
    ]
    assert radii[0] != radii[1]
    assert radii[0] == bench.data.updates[-1].radius_m


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--set", "motion.k1=3"), "changes nothing"),
        (("--set", "estimator.gain=3"), "alpha"),
        (("--set", "camera.method=moments"), "--from images"),
        (("--sweep", "estimator.alpha"), "a.b=1,2,3"),
        (("--sweep", "estimator.alpha=1000,-5"), "estimator.alpha"),
        (("--from", "nowhere"), "images"),
    ],
)
def test_questions_a_replay_cannot_answer_are_refused(
    arguments: tuple[str, ...], words: str, bench: Bench
) -> None:
    result = rig("replay", str(bench.run_dir), "--json", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert result.stdout == ""


def test_images_that_were_not_recorded_are_counted(bench: Bench) -> None:
    result = rig("replay", str(bench.run_dir), "--from", "images")
    frames = bench.data.frames
    assert f"{frames} of {frames} images are not in the log" in result.stderr


def test_a_sweep_compares_and_draws(bench: Bench, tmp_path: Path) -> None:
    plot = tmp_path / "sweep.png"
    arguments = ("--sweep", "estimator.alpha=500,2000,8000", "--plot", str(plot), "--json")
    result = rig("replay", str(bench.run_dir), *arguments)
    assert result.exit_code == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["estimator.alpha"] for line in lines] == [500, 2000, 8000]
    errors = [abs(line["radius_m"] - RADIUS_M) for line in lines]
    assert errors == sorted(errors, reverse=True)  # a larger gain converges sooner
    assert plot.read_bytes()[1:4] == b"PNG"
    assert "8000" in result.stderr


def test_the_log_of_a_killed_run_is_replayed_as_far_as_it_goes(
    bench: Bench, tmp_path: Path
) -> None:
    data = (bench.run_dir / "log.mcap").read_bytes()
    (tmp_path / "log.mcap").write_bytes(data[: int(0.7 * len(data))])
    result = rig("replay", str(tmp_path), "--json")
    assert result.exit_code == 0, result.stderr
    assert "never closed" in result.stderr and "identical to the run" in result.stderr
    assert 1.0 < json.loads(result.stdout)["sim_s"] < 2.9


def test_a_run_that_failed_says_so_again(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, ["safety.workspace_min_m=[-0.05,-2,0.05]"])
    bench.arm.fail_at_s = 1.5
    bench.run()
    result = rig("replay", str(tmp_path), "--json")
    assert result.exit_code == 4
    assert json.loads(result.stdout)["radius_m"] is None
    assert "the run failed: arm: the cable was pulled" in result.stderr


def rewritten(log: Path, out: Path, metadata: dict[str, dict[str, str]], config: bytes) -> None:
    """A log's messages under other metadata and another configuration."""
    with log.open("rb") as source, out.open("wb") as file:
        reader, writer = make_reader(source), Writer(file)
        writer.start(library="test")
        for one in reader.iter_metadata():
            if metadata.get(one.name) != {}:
                writer.add_metadata(one.name, {**one.metadata, **metadata.get(one.name, {})})
        if config:
            writer.add_attachment(0, 0, "config.yaml", "application/yaml", config)
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id]
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        writer.finish()


@pytest.mark.parametrize(
    ("metadata", "extra", "words"),
    [
        ({"activerig": {"format": "99", "version": "7.0"}}, b"", "format 99"),
        ({"activerig": {}}, b"", "no log of activerig"),
        ({"geometry": {}}, b"", "lacks geometry"),
        ({"run": {"target": '"torus"'}}, b"", "torus"),
        ({"activerig": {"version": "7.0"}}, b"\ngripper: {force_n: 3}\n", "gripper"),
    ],
)
def test_a_log_that_cannot_be_replayed_says_exactly_why(
    metadata: dict[str, dict[str, str]], extra: bytes, words: str, bench: Bench, tmp_path: Path
) -> None:
    config = (bench.run_dir / "config.yaml").read_bytes() + extra
    rewritten(bench.run_dir / "log.mcap", tmp_path / "log.mcap", metadata, config)
    with pytest.raises(ConfigError, match=words):
        replay(open_recording(tmp_path))


def test_a_log_without_its_configuration_says_so(bench: Bench, tmp_path: Path) -> None:
    rewritten(bench.run_dir / "log.mcap", tmp_path / "log.mcap", {}, b"")
    with pytest.raises(ConfigError, match=r"lacks config\.yaml"):
        open_recording(tmp_path)


def test_a_log_of_another_version_that_fits_is_replayed(bench: Bench, tmp_path: Path) -> None:
    config = (bench.run_dir / "config.yaml").read_bytes()
    rewritten(
        bench.run_dir / "log.mcap",
        tmp_path / "log.mcap",
        {"activerig": {"version": "0.0.9", "numpy": "1.26"}},
        config,
    )
    result = rig("replay", str(tmp_path))
    assert result.exit_code == 0
    assert "identical to the run" in result.stderr
