"""The renderer that lets MuJoCo draw with OpenGL, for everything a GPU draws better."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.gl_context import GlContext
from sim_backend.gl_model import gl_model
from sim_backend.lens import Lens
from sim_backend.mujoco_import import load_mujoco
from sim_backend.scene import Scene

FloatArray = NDArray[np.float64]

# Images are drawn this much finer than asked and averaged. OpenGL's four samples a pixel alone
# move an outline by 0.04 px (rms over sectors of 10 degrees), which is 0.1 % of a radius, and the
# corners of a board's texture by 0.05 px.
_OVERSAMPLING = 2


class GlRenderer:
    """Renders with MuJoCo's own renderer; any thread may use it, one at a time.

    Raises ConnectError when no OpenGL context can be made.
    """

    name = "gl"

    def __init__(self, scene: Scene, lens: Lens) -> None:
        self._mujoco = mujoco = load_mujoco()
        self._lens = lens
        focal_px = lens.focal_px * _OVERSAMPLING
        self._width, self._height = lens.width * _OVERSAMPLING, lens.height * _OVERSAMPLING
        self._map: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
        if not lens.ideal:
            self._width, self._height, self._map = _resampling(lens, focal_px)
        self._model: Any = gl_model(scene, self._width, self._height, focal_px)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = 0
        self._option = mujoco.MjvOption()
        self._scene = mujoco.MjvScene(self._model, maxgeom=200)
        for flag in ("SHADOW", "REFLECTION", "HAZE", "FOG", "SKYBOX"):
            self._scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = 0
        self._context: GlContext | None = GlContext(self._width, self._height)
        with self._context.current():
            self._gl = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._gl)

    def render(self, T_base_camera: FloatArray, rows: tuple[int, int]) -> NDArray[np.float32]:
        """See ``Renderer.render``; grey levels are whole numbers before they are averaged."""
        total = np.zeros((rows[1] - rows[0], self._lens.width), np.float32)
        for T in T_base_camera:
            total += self._draw(T)[rows[0] : rows[1]]
        return total / np.float32(len(T_base_camera))

    def close(self) -> None:
        """Free the context and what it holds."""
        if self._context is None:
            return
        with self._context.current():
            self._gl.free()
        self._context.free()
        self._context = None

    def _draw(self, T: FloatArray) -> NDArray[np.float32]:
        """The image (height, width) from the pose T_base_camera (4, 4)."""
        assert self._context is not None, "render after close"
        mujoco = self._mujoco
        # MuJoCo's camera looks along −z with y up; ours along z with y down.
        self._data.cam_xpos[0] = T[:3, 3]
        self._data.cam_xmat[0] = (T[:3, :3] * np.array([1.0, -1.0, -1.0])).ravel()
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._option,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        rgb = np.empty((self._height, self._width, 3), np.uint8)
        viewport = mujoco.MjrRect(0, 0, self._width, self._height)
        with self._context.current():
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._gl)
            mujoco.mjr_render(viewport, self._scene, self._gl)
            mujoco.mjr_readPixels(rgb, None, viewport, self._gl)
        grey = np.asarray(rgb[::-1, :, 0], np.float32)
        if self._map is not None:
            seen = cv2.remap(grey, *self._map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            grey = np.asarray(seen, np.float32)
        size = (self._lens.width, self._lens.height)
        return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.float32)


def _resampling(
    lens: Lens, focal_px: float
) -> tuple[int, int, tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Size of the centred pinhole image that covers the lens's view, and where to look in it.

    The maps are ``_OVERSAMPLING`` times as fine as the lens's pixels each way.
    """
    n = _OVERSAMPLING
    v, u = np.mgrid[0 : lens.height * n, 0 : lens.width * n]
    pixels = (np.stack([u.ravel(), v.ravel()], axis=1) + 0.5) / n - 0.5
    rays = focal_px * lens.to_rays(pixels)
    half = np.ceil(np.abs(rays).max(axis=0)) + 2.0
    width, height = (2 * half).astype(int)
    maps = (rays + (np.array([width, height]) - 1) / 2).astype(np.float32)
    shape = (lens.height * n, lens.width * n)
    return int(width), int(height), (maps[:, 0].reshape(shape), maps[:, 1].reshape(shape))
