"""What a run's log holds, read by the official MCAP reader with Foxglove's schemas."""

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import McapReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

from rig.config_load import load_config
from rig.live import QuietView
from rig.log.pixels import image_of
from rig.log.topics import TOPICS
from rig.run import RunResult, execute


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunResult]:
    """A short run of the simulated rig with an attachment."""
    run_dir = tmp_path_factory.mktemp("run")
    extra = run_dir / "lab.yaml"
    extra.write_text("rig: lab\n")
    settings = ["run.duration_s=0.6", "sim.renderer=raster", "sim.camera.latency_jitter_s=0"]
    config = load_config("sphere", None, settings)
    never = lambda: False  # noqa: E731
    result = execute(config, "sphere", run_dir, False, QuietView(), never, attachments=(extra,))
    return run_dir, result


@pytest.fixture
def reader(run: tuple[Path, RunResult]) -> Iterator[McapReader]:
    with (run[0] / "log.mcap").open("rb") as file:
        yield make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)


def test_every_kind_of_record_is_there_under_its_schema(
    reader: McapReader, run: tuple[Path, RunResult]
) -> None:
    found: Counter[tuple[str, str, str]] = Counter()
    for schema, channel, _ in reader.iter_messages():
        assert schema is not None
        found[channel.topic, schema.name, channel.message_encoding] += 1
    known = {(topic.name, topic.schema_name, topic.encoding) for topic in TOPICS}
    raw = ("/camera/image_raw", "foxglove.RawImage", "protobuf")
    assert set(found) == known - {raw}
    data = run[1].outcome.data
    counts = {topic: count for (topic, _, _), count in found.items()}
    assert counts["/camera/image"] == counts["/camera/feature"] == data.frames
    assert counts["/arm/state"] == len(data.arm_states)
    assert counts["/estimate/update"] == len(data.updates)
    assert counts["/control/tick"] == run[1].outcome.stats.ticks


def test_json_records_hold_what_their_schema_says(reader: McapReader) -> None:
    checked = set()
    for schema, channel, message in reader.iter_messages():
        if channel.message_encoding != "json" or channel.topic in checked:
            continue
        assert schema is not None and schema.encoding == "jsonschema"
        properties, values = json.loads(schema.data)["properties"], json.loads(message.data)
        assert values.keys() <= properties.keys()
        for key, value in values.items():
            assert conforms(value, properties[key]), (channel.topic, key, value)
        checked.add(channel.topic)
    assert len(checked) == 7


def conforms(value: Any, schema: dict[str, Any]) -> bool:
    """Whether a value is of a schema's type and shape."""
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    if value is None:
        return "null" in kinds
    if isinstance(value, list):
        right = schema.get("minItems", len(value)) == len(value) and "array" in kinds
        return right and all(conforms(one, schema["items"]) for one in value)
    names = {str: "string", int: "integer", float: "number", dict: "object"}
    return names[type(value)] in kinds or (isinstance(value, int) and "number" in kinds)


def test_messages_carry_when_they_were_true_and_when_they_were_logged(reader: McapReader) -> None:
    latencies_s = []
    last_ns = 0
    for _, channel, message in reader.iter_messages(log_time_order=False):
        assert message.publish_time <= message.log_time
        assert message.log_time >= last_ns
        last_ns = message.log_time
        if channel.topic == "/camera/image":
            latencies_s.append((message.log_time - message.publish_time) * 1e-9)
        if channel.message_encoding == "json":
            t_s = json.loads(message.data)["t_s"]
            assert message.publish_time == round(t_s * 1e9)
    latency_s = load_config("sphere").sim.camera.latency_s
    assert min(latencies_s) >= latency_s - 1e-8
    assert max(latencies_s) < latency_s + 0.03


def test_recorded_images_are_the_images_to_the_pixel(
    reader: McapReader, run: tuple[Path, RunResult]
) -> None:
    snapshot = run[1].outcome.data.newest_snapshot
    assert snapshot is not None
    decoded = list(reader.iter_decoded_messages(topics=["/camera/image"]))
    by_stamp = {one.message.publish_time: one.decoded_message for one in decoded}
    image = by_stamp[round(snapshot.t_s * 1e9)]
    assert image.format == "png" and image.frame_id == "camera"
    np.testing.assert_array_equal(image_of(image), snapshot.image)


def test_viewers_get_the_camera_its_frames_and_the_target(
    reader: McapReader, run: tuple[Path, RunResult]
) -> None:
    newest: dict[str, Any] = {}
    for one in reader.iter_decoded_messages(topics=["/camera/calibration", "/tf", "/target/pose"]):
        newest[one.channel.topic] = one.decoded_message
    lens, own = newest["/camera/calibration"], run[1].intrinsics
    assert list(lens.K) == [own.fx_px, 0, own.cx_px, 0, own.fy_px, own.cy_px, 0, 0, 1]
    assert (lens.width, lens.height) == (640, 480)
    pairs = [(one.parent_frame_id, one.child_frame_id) for one in newest["/tf"].transforms]
    assert pairs == [("base", "tool"), ("tool", "camera")]
    update = run[1].outcome.data.updates[-1]
    position = newest["/target/pose"].pose.position
    assert update.radius_m is not None
    np.testing.assert_allclose(
        [position.x, position.y, position.z], update.s * update.radius_m, rtol=1e-12
    )


def test_the_log_says_what_the_run_was(reader: McapReader, run: tuple[Path, RunResult]) -> None:
    metadata = {one.name: one.metadata for one in reader.iter_metadata()}
    assert metadata["activerig"]["format"] == "1"
    assert {"version", "python", "numpy", "scipy"} <= metadata["activerig"].keys()
    assert metadata["run"]["target"] == '"sphere"'
    assert metadata["run"]["seed"] == "1"
    files = {one.name: one.data for one in reader.iter_attachments()}
    assert files["config.yaml"] == (run[0] / "config.yaml").read_bytes()
    assert files["calibration/lab.yaml"] == b"rig: lab\n"


@pytest.mark.parametrize("images", ["jpeg", "raw", "off"])
def test_images_are_recorded_as_the_configuration_says(images: str, tmp_path: Path) -> None:
    settings = ["run.duration_s=0.3", "sim.renderer=raster", f"log.images={images}"]
    config = load_config("sphere", None, settings)
    execute(config, "sphere", tmp_path, False, QuietView(), lambda: False)
    with (tmp_path / "log.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages(topics=["/camera/image", "/camera/image_raw"]))
    assert bool(found) == (images != "off")
    assert {one.channel.topic for one in found} <= {
        "/camera/image_raw" if images == "raw" else "/camera/image"
    }
    for one in found:
        assert image_of(one.decoded_message).shape == (480, 640)
