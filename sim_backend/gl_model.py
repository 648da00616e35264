"""The scene as a MuJoCo model for its OpenGL renderer: shapes, light and floor, nothing moving."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.mujoco_import import load_mujoco
from sim_backend.scene import Cylinder, Scene, Sphere

# MuJoCo draws polyhedra. With these numbers the outline of a sphere of 61 px radius is 0.013 px
# too small; with MuJoCo's defaults (28, 16) it would be 0.33 px.
_SLICES, _STACKS = 256, 128
# Of the texture across the floor; odd, so that releases of MuJoCo agree on where it starts.
_FLOOR_PERIODS = 33


def gl_model(scene: Scene, width: int, height: int, focal_px: float) -> object:
    """The model, with one camera called ``eye`` that has the given pinhole."""
    mujoco = load_mujoco()
    size = scene.floor.greys.shape[0]
    model = mujoco.MjModel.from_xml_string(_mjcf(scene, width, height, focal_px))
    if size > 1:
        _fill_texture(model, scene.floor.greys)
    else:
        model.tex_data[:] = round(float(scene.floor.greys[0, 0]))
    return model


def _mjcf(scene: Scene, width: int, height: int, focal_px: float) -> str:
    fovy = float(np.rad2deg(2.0 * np.arctan(height / (2.0 * focal_px))))
    floor = scene.floor
    size = max(floor.greys.shape[0], 2)
    half = _FLOOR_PERIODS * size * floor.texel_m / 2
    diffuse = 1.0 - scene.ambient
    solids = "\n".join(_geom(solid) for solid in scene.solids)
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
  </asset>
  <worldbody>
    <light directional="true" castshadow="false" pos="0 0 5" dir="{_text(-scene.light)}"
      ambient="{scene.ambient} {scene.ambient} {scene.ambient}"
      diffuse="{diffuse} {diffuse} {diffuse}" specular="0 0 0"/>
    <geom type="plane" size="{half} {half} 1" material="floor"/>
    {solids}
    <camera name="eye" fovy="{fovy!r}"/>
  </worldbody>
</mujoco>
"""


def _geom(solid: Sphere | Cylinder) -> str:
    grey = solid.albedo_grey / 255.0
    look = f'material="matt" rgba="{grey} {grey} {grey} 1"'
    if isinstance(solid, Sphere):
        centre = _text(solid.centre_m)
        return f'<geom type="sphere" size="{solid.radius_m}" pos="{centre}" {look}/>'
    end = solid.half_length_m * solid.axis
    ends = f"{_text(solid.middle_m - end)} {_text(solid.middle_m + end)}"
    return f'<geom type="cylinder" size="{solid.radius_m}" fromto="{ends}" {look}/>'


def _text(vector: NDArray[np.float64]) -> str:
    return " ".join(repr(float(x)) for x in vector)


def _fill_texture(model: object, greys: NDArray[np.float32]) -> None:
    data = model.tex_data  # type: ignore[attr-defined]
    channels = data.size // greys.size
    # MuJoCo's origin lies in the middle of a texture, and its rows run along -y.
    upwards = np.rint(np.roll(greys, len(greys) // 2, axis=(0, 1))[::-1])
    data[:] = np.repeat(upwards.astype(np.uint8).ravel(), channels).reshape(data.shape)
