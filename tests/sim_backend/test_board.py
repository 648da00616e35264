"""The calibration board of the simulated world: its print, its place, its configuration."""

import numpy as np
import pytest
from pydantic import ValidationError

from sim_backend.board import build_board
from sim_backend.config import SimConfig
from sim_backend.config_targets import BoardConfig
from sim_backend.lens import lens_of
from sim_backend.scene import build_scene
from tests.sim_backend.charuco import expected, found, layout
from tests.sim_backend.helpers import FLAT, built, camera, drawn, view

TEXELS = 240  # per square of OpenCV's picture: a multiple of every cell's size


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"dictionary": "DICT_5X5_100"},
        {"squares": (5, 4), "dictionary": "DICT_6X6_250", "marker_m": 0.024},
        {"squares": (5, 4), "legacy": True},
    ],
    ids=["default", "5x5", "6x6", "legacy"],
)
def test_it_is_the_board_that_opencv_prints(settings):
    config = BoardConfig(**settings, white_grey=255, black_grey=0, margin_m=0.0)
    board = build_board(config)
    columns, rows = config.squares
    printed = layout(config).generateImage((columns * TEXELS, rows * TEXELS), marginSize=0)
    x = (np.arange(columns * TEXELS) + 0.5) / TEXELS * config.square_m
    y = (np.arange(rows * TEXELS) + 0.5) / TEXELS * config.square_m
    i = np.searchsorted(board.rows_m, y, side="right") - 1
    j = np.searchsorted(board.columns_m, x, side="right") - 1
    # OpenCV rounds cells to whole texels: at most one along their borders differs.
    assert np.mean(board.greys[np.ix_(i, j)] != printed) < 0.01


def test_its_start_shows_the_whole_board_and_opencv_finds_all_corners():
    config = SimConfig()
    scene, lens, T = view("board", config.board.start)
    pixels, points = found(drawn(scene, lens, T), config.board)
    assert len(points) == 24
    np.testing.assert_allclose(pixels, expected(points, scene.target, lens, T), atol=0.2)


def test_the_start_follows_a_board_that_hangs_on_a_wall():
    settings = {"board": {"rotvec_rad": (0.0, np.pi / 2, 0.0), "position_m": (0.5, 0.0, 0.4)}}
    config = SimConfig.model_validate(settings)
    scene, lens, T = view("board", config.board.start, **settings)
    assert len(found(drawn(scene, lens, T), config.board)[1]) == 24
    looks_along = T[:3, 2]
    assert looks_along @ scene.target.T_base_board[:3, 2] > 0.9


def test_an_invisible_board_leaves_the_floor():
    hidden, lens, T = view("board", SimConfig().board.start, board={"visible": False}, **FLAT)
    assert np.ptp(drawn(hidden, lens, T)) == 0.0


def test_from_behind_it_is_plain_paper():
    scene, lens, _ = view("board", SimConfig().board.start, **FLAT)
    below = np.eye(4)
    below[:3, 3] = (0.0, 0.0, 0.2)
    image = drawn(scene, lens, below)
    middle = image[200:280, 280:360]
    np.testing.assert_allclose(middle, 225.0)


def test_spheres_in_front_hide_it_and_those_behind_are_hidden():
    near = {"radius_m": 0.02, "position_m": (0.03, 0.0, 0.35), "albedo_grey": 90.0}
    far = {"radius_m": 0.05, "position_m": (-0.05, 0.0, 0.2), "albedo_grey": 140.0}
    scene, lens, T = view("board", SimConfig().board.start, **FLAT, distractor_spheres=[near, far])
    image = drawn(scene, lens, T)
    seen = lens.project((np.array([near["position_m"]]) - T[:3, 3]) @ T[:3, :3])[0]
    u, v = np.rint(seen).astype(int)
    assert image[v, u] == pytest.approx(90.0)
    alone, _, _ = view("board", SimConfig().board.start, **FLAT, distractor_spheres=[far])
    plain, _, _ = view("board", SimConfig().board.start, **FLAT)
    differs = np.abs(drawn(alone, lens, T) - drawn(plain, lens, T)) > 0.01
    corners = np.array([[x, y, 0.0] for x in (-0.01, 0.22) for y in (-0.01, 0.16)])
    outside = expected(corners, plain.target, lens, T)
    # Only beyond the sheet's sides may the far sphere show.
    v, u = np.nonzero(differs)
    inside = (u > outside[:, 0].min() + 25) & (u < outside[:, 0].max() - 25)
    inside &= (v > outside[:, 1].min() + 45) & (v < outside[:, 1].max() - 45)
    assert not np.any(inside)


def test_a_wrong_board_is_not_found():
    scene, lens, T = view("board", SimConfig().board.start, board={"dictionary": "DICT_5X5_50"})
    assert len(found(drawn(scene, lens, T), BoardConfig())[1]) == 0


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"marker_m": 0.03}, "board.marker_m"),
        ({"square_m": -0.03}, "board.square_m"),
        ({"squares": (7, 2)}, "board.squares.1"),
        ({"squares": (12, 12)}, "board.squares"),
        ({"dictionary": "DICT_4X5_50"}, "board.dictionary"),
        ({"position_m": (0.0, 0.0, -0.1)}, "board.position_m"),
        ({"rotvec_rad": (1.5, 0.0, 0.0), "position_m": (0.0, 0.0, 0.05)}, "board.position_m"),
        ({"margin_m": -0.01}, "board.margin_m"),
        ({"size": 3}, "board.size"),
    ],
)
def test_nonsense_is_refused_by_name(settings, key):
    with pytest.raises(ValidationError) as refusal:
        SimConfig.model_validate({"board": settings})
    places = [".".join(map(str, e["loc"])) for e in refusal.value.errors()]
    assert key in places or key in str(refusal.value)


def test_a_board_has_no_radius():
    rig, _ = built("board")
    with pytest.raises(ValueError, match="calibration board"):
        _ = rig.truth.radius_m
    with pytest.raises(ValueError, match="calibration board"):
        rig.truth.s(0.0)


def test_the_hidden_geometry_is_what_the_pictures_show():
    truth = {
        "T_tool_camera": (0.02, -0.03, 0.07, 0.15, -0.02, 0.2),
        "camera": camera(fx=812.0, fy=803.0, cx=330.0, cy=228.0, distortion=(-0.1, 0, 0, 0, 0)),
    }
    rig, clock = built("board", **truth)
    assert rig.intrinsics[:4] == (812.0, 803.0, 330.0, 228.0)
    np.testing.assert_allclose(rig.T_tool_camera[:3, 3], truth["T_tool_camera"][:3])
    clock.sleep_until(0.1)
    frame = rig.camera.read(0.1)
    T_base_tool = rig.arm.read_states()[-1].T_base_tool
    config = SimConfig.model_validate(truth)
    pixels, points = found(frame.image, config.board)
    board = build_scene(config, "board").target
    exact = expected(points, board, lens_of(config.camera), T_base_tool @ rig.T_tool_camera)
    assert len(points) == 24
    np.testing.assert_allclose(pixels, exact, atol=0.15)
