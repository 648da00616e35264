"""Which renderer a configuration gets."""

from typing import Literal

from drivers.errors import ConnectError
from sim_backend.gl import GlRenderer
from sim_backend.gl_context import why_no_gl
from sim_backend.lens import Lens
from sim_backend.raster import RasterRenderer
from sim_backend.renderer import Renderer
from sim_backend.scene import Scene, SceneKind

RendererName = Literal["raster", "gl"]


def choose_renderer(
    wanted: Literal["auto", "gl", "raster"], kind: SceneKind = "sphere"
) -> RendererName:
    """The renderer to use: with ``auto`` gl where an OpenGL context can be made, else raster.

    A board goes to raster with ``auto``: its corners are exact there, and a processor draws it
    several times faster. Raises ConnectError where ``gl`` is wanted and there is no OpenGL.
    """
    if wanted == "raster" or (wanted == "auto" and kind == "board"):
        return "raster"
    reason = why_no_gl()
    if not reason:
        return "gl"
    if wanted == "auto":
        return "raster"
    raise ConnectError(
        "sim.renderer = gl: no OpenGL context can be made here; install OpenGL's EGL library (on "
        "Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri) or choose sim.renderer = raster "
        f"({reason})"
    )


def make_renderer(name: RendererName, scene: Scene, lens: Lens) -> Renderer:
    """The named renderer, ready to draw ``scene`` through ``lens``."""
    return GlRenderer(scene, lens) if name == "gl" else RasterRenderer(scene, lens)
