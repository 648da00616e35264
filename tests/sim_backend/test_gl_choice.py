"""Which renderer is chosen, also where OpenGL or its configuration is broken."""

import os
import subprocess
import sys

import pytest

import sim_backend.render_choice as choice
from drivers.errors import ConnectError

SCRIPT = """
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.rig import SimulatedRig
import os
rig = SimulatedRig(SimConfig(renderer="{wanted}"), "sphere", SimulatedClock())
frame = rig.camera.read(1.0)
print(rig.renderer_name, frame.image.max() > 200, os.environ.get("MUJOCO_GL"))
"""
# Run first: stands in for a machine without the libraries, for ctypes and PyOpenGL alike.
HIDE = """
import ctypes, ctypes.util
find, load = ctypes.util.find_library, ctypes.CDLL.__init__
def gone(name): return name and any(x in str(name) for x in ("EGL", "GL.", "OSMesa", "glfw"))
ctypes.util.find_library = lambda name: None if name in ("EGL", "GL", "OSMesa") else find(name)
def guarded(self, name, *rest, **more):
    if gone(name): raise OSError(f"{name}: cannot open shared object file")
    load(self, name, *rest, **more)
ctypes.CDLL.__init__ = guarded
"""


def run(script, **environment):
    """Run ``script`` in a fresh interpreter and return (exit status, stdout, stderr)."""
    env = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**env, **environment},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    return done.returncode, done.stdout.strip(), done.stderr


@pytest.mark.parametrize("value", ["egl", "osmesa", "glfw", "nonsense"])
def test_a_broken_mujoco_gl_still_gives_the_software_renderer(value):
    status, out, err = run(HIDE + SCRIPT.format(wanted="auto"), MUJOCO_GL=value)
    assert status == 0, err
    assert out == f"raster True {value}"  # and the user's variable is left alone


def test_without_any_opengl_and_nothing_set_auto_is_raster():
    status, out, err = run(HIDE + SCRIPT.format(wanted="auto"))
    assert status == 0, err
    assert out == "raster True None"


def test_asking_for_gl_without_opengl_says_what_to_install():
    status, _, err = run(HIDE + SCRIPT.format(wanted="gl"), MUJOCO_GL="egl")
    assert status != 0
    last = err.strip().splitlines()[-1]
    assert last.startswith("drivers.errors.ConnectError: sim.renderer = gl")
    assert "apt install libegl1 libgl1-mesa-dri" in last


@pytest.mark.gl
@pytest.mark.usefixtures("gl")
def test_auto_takes_gl_where_a_context_can_be_made():
    status, out, err = run(SCRIPT.format(wanted="auto"))
    assert status == 0, err
    assert out == "gl True None"


@pytest.mark.parametrize(
    ("wanted", "reason", "name"),
    [("raster", "", "raster"), ("auto", "", "gl"), ("auto", "no", "raster"), ("gl", "", "gl")],
)
def test_the_choice(monkeypatch, wanted, reason, name):
    monkeypatch.setattr(choice, "why_no_gl", lambda: reason)
    assert choice.choose_renderer(wanted) == name


@pytest.mark.parametrize(("wanted", "name"), [("auto", "raster"), ("gl", "gl")])
def test_a_board_is_drawn_exactly_unless_gl_is_asked_for(monkeypatch, wanted, name):
    monkeypatch.setattr(choice, "why_no_gl", lambda: "")
    assert choice.choose_renderer(wanted, "board") == name


def test_gl_wanted_but_impossible_is_a_connect_error_with_the_reason(monkeypatch):
    monkeypatch.setattr(choice, "why_no_gl", lambda: "egl: library gone")
    with pytest.raises(ConnectError, match="egl: library gone"):
        choice.choose_renderer("gl")
