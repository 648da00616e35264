"""An OpenGL context without a window, from whichever library this machine can offer."""

import importlib
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from drivers.errors import ConnectError
from sim_backend.mujoco_import import load_mujoco, wanted_backend

_BACKENDS = ("egl", "glfw")


class GlContext:
    """A context that any thread may use in turn: it is current only inside ``current``.

    Raises ConnectError with each library's complaint when no context can be made.
    """

    def __init__(self, width: int, height: int) -> None:
        self._lock = threading.Lock()
        complaints = []
        for name in _candidates():
            try:
                module = importlib.import_module(f"mujoco.{name}")
                self._context: Any = module.GLContext(width, height)
            except _failures() as error:
                complaints.append(f"{name}: {error}")
                continue
            self._module, self._name = module, name
            return
        raise ConnectError("; ".join(complaints) or "no library to try")

    @contextmanager
    def current(self) -> Iterator[None]:
        """Make the context the calling thread's for a while; other threads wait."""
        with self._lock:
            self._context.make_current()
            try:
                yield
            finally:
                self._release()

    def free(self) -> None:
        """Give the context back; it must not be current in any thread."""
        self._context.free()

    def _release(self) -> None:
        if self._name == "glfw":
            importlib.import_module("glfw").make_context_current(None)
            return
        egl, display = self._module.EGL, self._module.EGL_DISPLAY
        egl.eglMakeCurrent(display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)


@cache
def why_no_gl() -> str:
    """Why MuJoCo cannot render with OpenGL here; empty when it can. Tried once a process."""
    try:
        context = GlContext(16, 16)
    except ConnectError as error:
        return str(error)
    mujoco = load_mujoco()
    try:
        with context.current():
            model = mujoco.MjModel.from_xml_string("<mujoco/>")
            mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100).free()
    except _failures() as error:
        return str(error)
    context.free()
    return ""


def _candidates() -> list[str]:
    """Libraries to try in turn: the user's MUJOCO_GL first, GLFW only where there is a display."""
    wanted = wanted_backend()
    if wanted in ("disable", "disabled", "off", "false", "0"):
        return []
    names = [name for name in _BACKENDS if name != "glfw" or os.environ.get("DISPLAY")]
    return sorted(names, key=lambda name: name != wanted)


def _failures() -> tuple[type[Exception], ...]:
    """What a missing or broken OpenGL library raises on import and on use."""
    mujoco = load_mujoco()
    failures: tuple[type[Exception], ...] = (
        ImportError,
        AttributeError,  # PyOpenGL when the library is not there
        OSError,
        RuntimeError,
        TypeError,
        mujoco.FatalError,
    )
    for module, name in (("OpenGL.error", "Error"), ("glfw", "GLFWError")):
        try:
            failures += (getattr(importlib.import_module(module), name),)
        except (ImportError, AttributeError, OSError):
            continue  # then it cannot raise its errors either
    return failures
