"""``rig measure``: what it prints, and how it refuses."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.errors import ConfigError
from rig.intrinsics_option import read_intrinsics
from tests.estimator.image.exact_images import Look, cylinder_s, render
from tests.rig.command_line import rig

CAMERA = "800,800,319.5,239.5"
SPHERE = np.array([0.4, -0.3, 12.8])
AXIS = np.array([0.3, 0.95, 0.0]) / np.linalg.norm([0.3, 0.95, 0.0])
CYLINDER = cylinder_s(np.array([0.2, 0.0, 9.0]), AXIS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Image files of every kind, once for all tests."""
    path = tmp_path_factory.mktemp("images")
    rng = np.random.default_rng(1)
    sphere = render(SPHERE, None, Look(), rng)
    cv2.imwrite(str(path / "sphere.png"), sphere)
    cv2.imwrite(str(path / "colour.png"), cv2.cvtColor(sphere, cv2.COLOR_GRAY2BGR))
    cv2.imwrite(str(path / "deep.png"), sphere.astype(np.uint16) * 257)
    cv2.imwrite(str(path / "empty.png"), np.full((480, 640), 20, np.uint8))
    cv2.imwrite(str(path / "pipe.png"), render(CYLINDER, AXIS, Look(), rng))
    whole = (path / "sphere.png").read_bytes()
    (path / "damaged.png").write_bytes(whole[:60])
    (path / "notes.png").write_text("no image")
    return path


def lines(folder: Path, names: list[str], *options: str) -> list[dict[str, object]]:
    paths = [str(folder / name) for name in names]
    result = rig("measure", *paths, "--intrinsics", CAMERA, "--json", *options)
    assert result.exit_code == 0, result.stderr
    return [json.loads(line) for line in result.stdout.splitlines()]


@pytest.mark.parametrize("options", [(), ("--sequence",), ("--method", "moments")])
def test_one_json_line_per_image_in_the_order_given(folder: Path, options: tuple[str, ...]) -> None:
    names = ["sphere.png", "empty.png", "colour.png", "deep.png"]
    records = lines(folder, names, "--target", "sphere", *options)
    assert [Path(str(r["image"])).name for r in records] == names
    assert [r["found"] for r in records] == [True, False, True, True]
    for record in records:
        assert list(record) == ["image", "found", "reason", "s", "s_std", "cpu_ms"]
        assert isinstance(record["cpu_ms"], float)
        if record["found"]:
            assert record["reason"] is None
            assert np.allclose(record["s"], SPHERE, rtol=2e-3, atol=5e-3)  # type: ignore[arg-type]
            assert np.all(np.array(record["s_std"]) > 0.0)
        else:
            assert record["reason"] and record["s"] is None and record["s_std"] is None


def test_grey_colour_and_16_bit_files_of_one_image_measure_alike(folder: Path) -> None:
    names = ["sphere.png", "colour.png", "deep.png"]
    grey, colour, deep = lines(folder, names, "--target", "sphere")
    assert grey["s"] == colour["s"] == deep["s"]


def test_cylinders_come_with_their_axis(folder: Path) -> None:
    found, empty = lines(folder, ["pipe.png", "empty.png"], "--target", "cylinder")
    assert list(found) == ["image", "found", "reason", "s", "axis", "s_std", "cpu_ms"]
    assert np.allclose(found["s"], CYLINDER, rtol=1e-3, atol=2e-3)  # type: ignore[arg-type]
    assert abs(np.array(found["axis"]) @ AXIS) > 0.9999
    assert empty["axis"] is None and empty["s"] is None


def test_without_json_each_image_is_a_readable_line(folder: Path) -> None:
    result = rig(
        "measure",
        str(folder / "sphere.png"),
        str(folder / "empty.png"),
        "--target",
        "sphere",
        "--intrinsics",
        CAMERA,
    )
    one, other = result.stdout.splitlines()
    assert "s = (" in one and "±" in one
    assert "not found: " in other and result.exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["sphere.png", "missing.png"], "missing.png"),
        (["sphere.png", "notes.png"], "notes.png"),
        (["sphere.png", "."], "not a file"),
    ],
)
def test_wrong_files_are_named_before_anything_is_printed(
    folder: Path, arguments: list[str], named: str
) -> None:
    paths = [str(folder / name) for name in arguments]
    result = rig("measure", *paths, "--target", "sphere", "--intrinsics", CAMERA, "--json")
    assert result.exit_code == 2 and result.stdout == "" and named in result.stderr


def test_moments_of_a_cylinder_is_an_error(folder: Path) -> None:
    result = rig(
        "measure",
        str(folder / "pipe.png"),
        "--target",
        "cylinder",
        "--method",
        "moments",
        "--intrinsics",
        CAMERA,
    )
    assert result.exit_code == 2 and "spheres only" in result.stderr and result.stdout == ""


def test_a_damaged_image_is_reported_and_the_others_are_measured(folder: Path) -> None:
    result = rig(
        "measure",
        str(folder / "damaged.png"),
        str(folder / "sphere.png"),
        "--target",
        "sphere",
        "--intrinsics",
        CAMERA,
        "--json",
    )
    damaged, sphere = (json.loads(line) for line in result.stdout.splitlines())
    assert not damaged["found"] and "damaged" in damaged["reason"]
    assert sphere["found"] and result.exit_code == 2 and "damaged.png" in result.stderr


def test_intrinsics_from_numbers_and_from_files_agree(tmp_path: Path) -> None:
    plain = tmp_path / "plain.yaml"
    plain.write_text("fx: 800\nfy: 790\ncx: 320\ncy: 240\ndistortion: [-0.1, 0.01, 0, 0, 0]\n")
    nested = tmp_path / "nested.yaml"
    nested.write_text("intrinsics: {fx: 800, fy: 790, cx: 320, cy: 240, distortion: [-0.1, 0.01]}")
    numbers = read_intrinsics("800,790,320,240,-0.1,0.01")
    for other in (read_intrinsics(str(plain)), read_intrinsics(str(nested))):
        assert (numbers.fx_px, numbers.fy_px) == (other.fx_px, other.fy_px) == (800.0, 790.0)
        assert (numbers.cx_px, numbers.cy_px) == (other.cx_px, other.cy_px) == (320.0, 240.0)
        assert np.array_equal(numbers.distortion, other.distortion)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("800,800,320", "3 numbers"),
        ("800,800,320,240,0,0,0,0,0,0", "10 numbers"),
        ("800,x,320,240", "fy is 'x'"),
        ("-800,800,320,240", "fx"),
        ("800,nan,320,240", "fy"),
        ("nowhere.yaml", "nowhere.yaml"),
    ],
)
def test_wrong_intrinsics_are_named(text: str, named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        read_intrinsics(text)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("fx: 800\nfy: 800\ncx: 1\n", "cy"),
        ("fx: 800\nfy: 800\ncx: 1\ncy: 1\nk1: 0.1\n", "k1"),
        ("[1, 2]", "expected keys"),
        ("fx: [", "cannot be read as YAML"),
    ],
)
def test_wrong_intrinsics_files_are_named(tmp_path: Path, content: str, named: str) -> None:
    file = tmp_path / "camera.yaml"
    file.write_text(content)
    with pytest.raises(ConfigError, match=named) as error:
        read_intrinsics(str(file))
    assert "camera.yaml" in str(error.value)
