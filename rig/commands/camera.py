"""``rig camera``: which cameras there are, what they see, and how well they deliver."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from drivers.errors import ConfigError, ConnectError, OperateError
from rig.commands.options import AsJson, warn
from rig.exit_codes import WITH_DEVICE, ExitCode

if TYPE_CHECKING:
    from drivers.camera.settings import CameraSettings
    from drivers.camera.v4l2_nodes import VideoNode

camera_app = typer.Typer(
    name="camera",
    help="Find, look through and check cameras; none of it needs a rig file.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

# What --size, --fps, --fourcc and --exposure-ms leave alone when they are not given.
_AS_IT_IS = "default: as the camera has it."

SourceOption = Annotated[
    str | None,
    typer.Option(
        "--source",
        help="Index, /dev/videoN, /dev/v4l/by-id/..., http:// or rtsp:// URL, video file, image "
        "folder or glob; default: the only camera connected.",
    ),
]
Size = Annotated[
    str | None, typer.Option(metavar="WxH", help=f"Ask for this size in px; {_AS_IT_IS}")
]
Fps = Annotated[
    float | None,
    typer.Option(min=0.1, max=1000.0, help=f"Ask for so many images a second; {_AS_IT_IS}"),
]
Fourcc = Annotated[
    str | None, typer.Option(help=f"Ask for this format, such as YUYV or MJPG; {_AS_IT_IS}")
]
Exposure = Annotated[
    float | None,
    typer.Option("--exposure-ms", min=0.01, help=f"Fix the exposure time, in ms; {_AS_IT_IS}"),
]
_ALL_REQUESTS = (
    "fourcc", "size", "rate", "exposure", "gain", "focus", "white_balance", "power_line",
)  # fmt: skip


@camera_app.command("list", epilog=WITH_DEVICE)
def list_cameras(source: SourceOption = None, as_json: AsJson = False) -> None:
    """List the cameras: stable names, modes, who holds them; --source shows all modes of one."""
    from drivers.camera.v4l2_nodes import list_nodes
    from rig.commands.camera_text import modes_text

    nodes = [_node_of(source)] if source is not None else list_nodes()
    if as_json:
        print(json.dumps({"cameras": [dataclasses.asdict(node) for node in nodes]}))
        return
    cameras = [node for node in nodes if node.captures is not False]
    if not cameras:
        warn(
            "no camera is connected to this machine. Plug one in (rig camera list shows it), or "
            "give --source with a stream's URL, a video file or an image folder"
        )
        return
    table = Table("node", "camera", "modes", "held by")
    for node in cameras:
        held = ", ".join(str(holder) for holder in node.holders) or "–"
        modes = modes_text(node, whole=source is not None)
        table.add_row(node.node, node.name or "–", modes, held)
    console = Console()
    console.print(table)
    for node in cameras:
        # Never cut or broken: a name is there to be copied.
        names = ", ".join(node.by_id) or "no stable name (one needs a USB camera)"
        console.print(f"{node.node}: {names}", soft_wrap=True, highlight=False)


@camera_app.command(epilog=WITH_DEVICE)
def show(
    source: SourceOption = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the picture to this file; default: nowhere.")
    ] = None,
    size: Size = None,
    fps: Fps = None,
    fourcc: Fourcc = None,
    exposure_ms: Exposure = None,
) -> None:
    """Take one fresh picture: a coarse view in the terminal, its numbers, and a file if asked."""
    from drivers.camera.open import open_camera
    from drivers.clock import WallClock
    from rig.commands.camera_preview import half_blocks, numbers, save_image

    # Its rate does not matter for one picture, and measuring it takes seconds.
    settings = _settings(source, size, fps, fourcc, exposure_ms, rate_check_s=0.0)
    clock = WallClock()
    camera = open_camera(settings, clock)
    try:
        frame = camera.read_after(clock.now_s(), timeout_s=settings.select_timeout_s + 2.0)
        age_s = clock.now_s() - (0.0 if frame is None else frame.t_exposure_mid_s)
        health = camera.health()
    finally:
        camera.close()
    for warning in health.warnings:
        warn(f"warning: {warning}")
    if frame is None:
        raise OperateError(f"camera {settings.source}: no fresh picture came: {health.problem}")
    console = Console()
    if console.is_terminal:
        console.print(half_blocks(frame.image, console.width, console.height - 6))
    console.print(numbers(frame, age_s), highlight=False, soft_wrap=True)
    if save is not None:
        save_image(save, frame.image)
        console.print(f"written: {save}", highlight=False, soft_wrap=True)


@camera_app.command(epilog=WITH_DEVICE)
def check(
    source: SourceOption = None,
    seconds: Annotated[
        float, typer.Option("--for", min=0.2, max=3600.0, help="Seconds to read.")
    ] = 5.0,
    size: Size = None,
    fps: Fps = None,
    fourcc: Fourcc = None,
    exposure_ms: Exposure = None,
    as_json: AsJson = False,
) -> None:
    """Measure mode, rate, stamps, latency and losses; exit status 3 when something is wrong."""
    from drivers.camera.check import check_camera
    from drivers.camera.open import open_camera
    from drivers.clock import WallClock
    from rig.commands.camera_text import cell, report

    settings = _settings(source, size, fps, fourcc, exposure_ms)
    clock = WallClock()
    camera = open_camera(settings, clock)
    try:
        result = check_camera(camera, clock, seconds)
    finally:
        camera.close()
    figures = report(result)
    if as_json:
        print(json.dumps(figures))
    else:
        table = Table(title=f"camera {settings.source}", show_header=False)
        for name, value in figures.items():
            table.add_row(name.replace("_", " "), cell(name, value))
        Console().print(table)
    if not figures["ok"]:
        raise typer.Exit(ExitCode.DEVICE)


def _settings(
    source: str | None,
    size: str | None,
    fps: float | None,
    fourcc: str | None,
    exposure_ms: float | None,
    rate_check_s: float = 2.0,
) -> "CameraSettings":
    """The options as settings; what does not hold is shown as a warning, not refused."""
    from pydantic import ValidationError

    from drivers.camera.settings import CameraControls, CameraSettings

    width, height = (None, None) if size is None else _size(size)
    try:
        return CameraSettings(
            source=_only_camera() if source is None else source,
            width=width,
            height=height,
            rate_hz=fps,
            fourcc=fourcc,
            controls=CameraControls(exposure_ms=exposure_ms),
            optional=_ALL_REQUESTS,  # type: ignore[arg-type]
            rate_check_s=rate_check_s,
            loop=True,
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigError(f"{'.'.join(str(k) for k in first['loc'])}: {first['msg']}") from error


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise ConfigError(f"--size {text!r}: write it as 640x480")
    return int(width), int(height)


def _only_camera() -> str:
    from drivers.camera.v4l2_nodes import list_nodes

    names = [(*node.by_id, node.node)[0] for node in list_nodes() if node.captures]
    if len(names) == 1:
        return names[0]
    if not names:
        raise ConnectError(
            "no camera is connected to this machine; plug one in, or give --source with a "
            "stream's URL, a video file or an image folder"
        )
    raise ConfigError(f"several cameras are connected; choose with --source: {', '.join(names)}")


def _node_of(source: str) -> "VideoNode":
    from drivers.camera.source import SourceKind, parse_source
    from drivers.camera.v4l2_nodes import list_nodes, resolve_node, why_not_opened

    parsed = parse_source(source)
    if parsed.kind is not SourceKind.DEVICE:
        raise ConfigError(f"rig camera list shows devices; {source} is a {parsed.kind.value}")
    node = resolve_node(parsed.address)
    for found in list_nodes():
        if found.node == node:
            return found
    raise ConnectError(why_not_opened(parsed.address))
