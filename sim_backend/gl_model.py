"""The scene as a MuJoCo model for its OpenGL renderer: shapes, light and floor, nothing moving."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_backend.board import Board
from sim_backend.mujoco_import import load_mujoco
from sim_backend.scene import Cylinder, Scene, Sphere

FloatArray = NDArray[np.float64]

# MuJoCo draws polyhedra with their corners on the surface, which look too small: a sphere with
# its defaults (28 slices, 16 stacks) by 5e-3, with these by 7e-5 from above and 6e-5 from elsewhere
# (the area of the projected corners' hull), a cylinder's sides by 2.5e-5 on average over its turns
# (1 - sin(x)/x for x = pi/slices). The radii make up for that.
_SLICES, _STACKS = 256, 128
_SPHERE_GROWN, _CYLINDER_GROWN = 1.0 + 6.7e-5, 1.0 + 2.5e-5
# Of the texture across the floor; odd, so that releases of MuJoCo agree on where it starts.
_FLOOR_PERIODS = 33
_BOARD_TEXELS = 2048  # a side of the board's texture; a power of two, for unbiased mipmaps
_BACK_BEHIND_M = 1e-4  # the back of the board behind its front


def gl_model(scene: Scene, width: int, height: int, focal_px: float) -> object:
    """The model, with one camera called ``eye`` that has the given pinhole."""
    mujoco = load_mujoco()
    size = scene.floor.greys.shape[0]
    model = mujoco.MjModel.from_xml_string(_mjcf(scene, width, height, focal_px))
    if size > 1:
        # MuJoCo's origin lies in the middle of a texture, and its rows run along -y.
        floor = np.roll(scene.floor.greys, size // 2, axis=(0, 1))[::-1]
    else:
        floor = np.full((2, 2), scene.floor.greys[0, 0])
    _fill_texture(model, "floor", floor)
    if scene.board is not None:
        _fill_texture(model, "board", _board_texture(scene.board))
    return model


def _mjcf(scene: Scene, width: int, height: int, focal_px: float) -> str:
    fovy = float(np.rad2deg(2.0 * np.arctan(height / (2.0 * focal_px))))
    floor = scene.floor
    size = max(floor.greys.shape[0], 2)
    half = _FLOOR_PERIODS * size * floor.texel_m / 2
    diffuse = 1.0 - scene.ambient
    solids = "\n".join(_geom(solid) for solid in scene.solids)
    board, board_asset = ("", "") if scene.board is None else _board_xml(scene.board)
    return f"""
<mujoco model="scene">
  <visual>
    <headlight active="0"/>
    <quality numslices="{_SLICES}" numstacks="{_STACKS}" offsamples="4" shadowsize="0"/>
    <global offwidth="{width}" offheight="{height}"/>
    <map znear="0.01" zfar="60"/>
    <rgba haze="0 0 0 0" fog="0 0 0 0"/>
  </visual>
  <statistic extent="1" center="0 0 0"/>
  <asset>
    <texture name="floor" type="2d" builtin="flat" rgb1="0 0 0" width="{size}" height="{size}"/>
    <material name="floor" texture="floor" texrepeat="{_FLOOR_PERIODS} {_FLOOR_PERIODS}"
      emission="1" specular="0" shininess="0" reflectance="0"/>
    <material name="matt" specular="0" shininess="0" reflectance="0"/>
    {board_asset}
  </asset>
  <worldbody>
    <light directional="true" castshadow="false" pos="0 0 5" dir="{_text(-scene.light)}"
      ambient="{scene.ambient} {scene.ambient} {scene.ambient}"
      diffuse="{diffuse} {diffuse} {diffuse}" specular="0 0 0"/>
    <geom type="plane" size="{half} {half} 1" material="floor"/>
    {solids}
    {board}
    <camera name="eye" fovy="{fovy!r}"/>
  </worldbody>
</mujoco>
"""


def _geom(solid: Sphere | Cylinder) -> str:
    grey = solid.albedo_grey / 255.0
    look = f'material="matt" rgba="{grey} {grey} {grey} 1"'
    if isinstance(solid, Sphere):
        centre = _text(solid.centre_m)
        radius = solid.radius_m * _SPHERE_GROWN
        return f'<geom type="sphere" size="{radius}" pos="{centre}" {look}/>'
    end = solid.half_length_m * solid.axis
    ends = f"{_text(solid.middle_m - end)} {_text(solid.middle_m + end)}"
    radius = solid.radius_m * _CYLINDER_GROWN
    return f'<geom type="cylinder" size="{radius}" fromto="{ends}" {look}/>'


def _text(vector: NDArray[np.float64]) -> str:
    return " ".join(repr(float(x)) for x in vector)


def _board_xml(board: Board) -> tuple[str, str]:
    """The board as a geometry and the assets it needs."""
    (left, right), (top, bottom) = board.columns_m[[0, -1]], board.rows_m[[0, -1]]
    T = board.T_base_board
    middle = T[:3, :3] @ [(left + right) / 2, (top + bottom) / 2, 0.0] + T[:3, 3]
    size = f"{(right - left) / 2} {(bottom - top) / 2} 1"
    # The printed side of a plane is its z; its y runs up the print. The back is one more plane.
    axes = _text(np.concatenate([T[:3, 0], -T[:3, 1]]))
    back_axes, back = _text(T[:3, :2].T.ravel()), middle + _BACK_BEHIND_M * T[:3, 2]
    grey = board.white_grey / 255.0
    asset = f"""<texture name="board" type="2d" builtin="flat" rgb1="0 0 0"
      width="{_BOARD_TEXELS}" height="{_BOARD_TEXELS}"/>
    <material name="board" texture="board" texrepeat="1 1" specular="0" shininess="0"
      reflectance="0"/>"""
    geom = f"""<geom type="plane" size="{size}" pos="{_text(middle)}" xyaxes="{axes}"
      material="board"/>
    <geom type="plane" size="{size}" pos="{_text(back)}" xyaxes="{back_axes}"
      material="matt" rgba="{grey} {grey} {grey} 1"/>"""
    return geom, asset


def _board_texture(board: Board) -> FloatArray:
    """The print, its rows as MuJoCo orders them; each texel is the mean over its area."""
    rows = _overlaps(board.rows_m)
    columns = _overlaps(board.columns_m)
    texture: FloatArray = rows @ board.greys @ columns.T
    return texture


def _overlaps(breaks_m: FloatArray) -> FloatArray:
    """The share of each texel (n, cells) that lies in each cell."""
    texels = np.linspace(breaks_m[0], breaks_m[-1], _BOARD_TEXELS + 1)
    reached = np.clip(texels[:, None], breaks_m[None, :-1], breaks_m[None, 1:])
    lengths: FloatArray = np.diff(reached, axis=0) / (texels[1] - texels[0])
    return lengths


def _fill_texture(model: Any, name: str, greys: NDArray[np.floating]) -> None:
    texture = load_mujoco().mj_name2id(model, load_mujoco().mjtObj.mjOBJ_TEXTURE, name)
    channels = int(model.tex_nchannel[texture])
    begin = int(model.tex_adr[texture])
    data = model.tex_data[begin : begin + greys.size * channels]
    data[:] = np.repeat(np.rint(greys).astype(np.uint8).ravel(), channels)
