"""The page's panel: STOP, the numbers, the camera's image, two plots."""

import base64
import html
from collections.abc import Callable

import cv2
import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from rig.page.history import History
from rig.page.state import PageState

ColourImage = NDArray[np.uint8]  # (height, width, 3)

_WIDTH_PX = 470.0
_PLOT_EVERY_S = 0.25
_JPEG_QUALITY = 80
_IMAGE = "padding:0 .8em;font-size:.8em;text-align:center"
_WHAT_STOP_DOES = "Ramp the arm to rest and end the run, as Ctrl-C does"
# The icon tells this button from viser's own.
_LARGE_STOP = (
    "<style>button:has(.icon-tabler-hand-stop)"
    "{height:4.5rem;font-size:1.6rem;letter-spacing:.04em}</style>"
)
_STATE_COLOURS = {
    "running": "#2e8b57",
    "holding": "#c77700",
    "stopping": "#c77700",
    "fault": "#b42318",
}
_BLUE, _PALE, _RED = "#1f5fa8", "#9dbbe0", "#d1495b"


class Panel:
    """What is beside the scene; ``on_stop`` is called, from any thread, when STOP is pressed."""

    def __init__(self, server: viser.ViserServer, on_stop: Callable[[], None] | None) -> None:
        self._gui = gui = server.gui
        self._on_stop = on_stop
        self._history = History()
        self._plotted_s = float("-inf")
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.set_panel_label("activerig")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_WIDTH_PX)
        if on_stop is not None:
            self._add_stop()
        self._numbers = gui.add_html("")
        self._image = gui.add_html("")
        self._add_plots()

    def update(self, state: PageState) -> None:
        """Show the numbers of ``state``; the plots follow four times a second."""
        self._history.add(state)
        self._numbers.content = numbers_html(state, self._history.rate_hz)
        if abs(state.elapsed_s - self._plotted_s) >= _PLOT_EVERY_S:
            self._plotted_s = state.elapsed_s
            self._radius_plot.data = self._history.radius()
            self._health_plot.data = self._history.health()

    def show_image(self, image: ColourImage, caption: str) -> None:
        """Show a BGR image."""
        self._image.content = image_html(image, caption)

    def end(self, text: str) -> None:
        """The run is over: nothing can be stopped any more."""
        if self._on_stop is not None:
            self._stop.label, self._stop.disabled = text, True

    def _add_stop(self) -> None:
        self._gui.add_html(_LARGE_STOP)
        self._stop = self._gui.add_button(
            "STOP   (space bar)",
            color="red",
            icon=viser.Icon.HAND_STOP,
            hint="Ramp the arm to rest",
        )
        self._stop.on_click(lambda _: self._pressed())
        command = self._gui.add_command("STOP", description=_WHAT_STOP_DOES, hotkey="space")
        command.on_trigger(lambda _: self._pressed())

    def _pressed(self) -> None:
        assert self._on_stop is not None
        self._on_stop()  # before anything is drawn
        self._stop.label = "STOP requested"

    def _add_plots(self) -> None:
        def series(label: str, colour: str) -> uplot.Series:
            return uplot.Series(label=label, stroke=colour, width=2)

        self._radius_plot = self._gui.add_uplot(
            self._history.radius(),
            (
                uplot.Series(label="t [s]"),
                series("− σ", _PALE),
                series("+ σ", _PALE),
                series("R̂ [mm]", _BLUE),
            ),
            scales={"x": uplot.Scale(time=False)},
            height=190,
            title="radius",
        )
        self._health_plot = self._gui.add_uplot(
            self._history.health(),
            (
                uplot.Series(label="t [s]"),
                series("late [ms]", _BLUE),
                series("ticks missed", _RED),
            ),
            scales={"x": uplot.Scale(time=False)},
            height=170,
            title="control loop",
        )


def image_html(image: ColourImage, caption: str) -> str:
    """An image with its caption; the pixels are in the text itself.

    Viser's own images are fetched by the browser under names that the next image makes invalid,
    which a slow one answers with errors and gaps.
    """
    ok, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    assert ok  # an image of this type always encodes
    data = base64.b64encode(jpeg.tobytes()).decode("ascii")
    height, width = image.shape[:2]
    return (
        f'<div style="{_IMAGE}"><img id="rig-image" alt="camera" decoding="sync" '
        f'style="height:260px;aspect-ratio:{width}/{height};max-width:100%" '
        f'src="data:image/jpeg;base64,{data}">'
        f'<div id="rig-caption">{html.escape(caption)}</div></div>'
    )


def numbers_html(state: PageState, rate_hz: float | None) -> str:
    """The table of numbers; each value's element has an id."""
    word = state.state.partition(":")[0]
    colour = _STATE_COLOURS.get(word, "#5f6c7b")
    rows = [
        ("target", "target", html.escape(state.target_state)),
        ("limited by", "limits", html.escape(", ".join(state.limited_by) or "nothing")),
        ("speed", "speed", f"{1e3 * state.speed_m_s:.1f} mm/s"),
        ("images", "frames", f"{state.frames}, {state.frames_lost} without an outline"),
        ("loop", "loop", _loop_text(state, rate_hz)),
        ("time", "time", f"{state.elapsed_s:.2f} s"),
    ]
    cells = "".join(
        f'<tr><td style="color:#5f6c7b;padding-right:1em">{name}</td>'
        f'<td id="rig-{key}">{value}</td></tr>'
        for name, key, value in rows
    )
    return (
        '<div style="padding:0 .8em;font-size:.9em;font-variant-numeric:tabular-nums">'
        f'<div id="rig-state" style="color:white;background:{colour};border-radius:4px;'
        f'padding:.2em .6em">{html.escape(state.state)}</div>'
        f'<div id="rig-radius" style="font-size:1.7em;font-weight:600">{_radius_text(state)}</div>'
        f"<table>{cells}</table></div>"
    )


def _radius_text(state: PageState) -> str:
    if state.radius_m is None:
        return "R̂ –"
    spread = "" if state.spread_m is None else f" ± {1e3 * state.spread_m:.3f}"
    kind = " σ" if state.spread_stated else " (transient)"
    return (
        f"R̂ {1e3 * state.radius_m:.3f}"
        f'<span style="font-size:.65em;font-weight:400">{spread} mm{kind if spread else ""}</span>'
    )


def _loop_text(state: PageState, rate_hz: float | None) -> str:
    rate = "" if rate_hz is None else f"{rate_hz:.1f} Hz, "
    return f"{rate}{1e3 * state.late_s:.2f} ms late, {state.overruns} ticks missed"
