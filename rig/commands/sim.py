"""``rig sim``: an emulated rig behind the real protocols, and faults in it."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from rig.commands.options import Assignments, warn
from rig.exit_codes import WITH_DEVICE

sim_app = typer.Typer(
    help="An emulated rig behind the real protocols, to try the true drivers on.",
    no_args_is_help=True,
)
Host = Annotated[str, typer.Option(help="A loopback address: 127.0.0.1, 127.0.0.2, …")]

# What one kind of arm calls differently, or has only the like of: tried where the arm does not
# know the name itself.
_NEAREST = {"protective_stop": "alarm", "alarm": "protective_stop", "program_stop": "reset"}
_CAMERA_FAULTS = "camera_unplug, camera_freeze, camera_repeat"


@sim_app.command(epilog=WITH_DEVICE)
def serve(
    arm: Annotated[
        Literal["ur", "grbl"], typer.Option(help="A UR5e, or a gantry under grblHAL.")
    ] = "ur",
    camera: Annotated[
        bool, typer.Option("--camera", help="Also stream the camera on its tool (MJPEG).")
    ] = False,
    target: Annotated[
        Literal["sphere", "cylinder", "board"],
        typer.Option(help="What stands before it; the board is what `rig calibrate` looks at."),
    ] = "sphere",
    host: Host = "127.0.0.1",
    link: Annotated[
        Path, typer.Option(help="The gantry's serial port: a link to a pseudo-terminal.")
    ] = Path("/tmp/activerig-gantry"),
    port: Annotated[int, typer.Option(help="The camera stream's port; 0: a free one.")] = 8088,
    for_s: Annotated[
        float, typer.Option("--for", min=1.0, max=86400.0, help="Seconds until it ends.")
    ] = 3600.0,
    ur_version: Annotated[
        str | None,
        typer.Option(
            help="The UR controller's software version; 3.… is a CB3, 125 Hz; default: 5.15."
        ),
    ] = None,
    rig: Annotated[
        Path | None, typer.Option("--rig", help="The rig's YAML file; default: the arm's own.")
    ] = None,
    assignments: Assignments = None,
) -> None:
    """Serve an emulated arm, and its camera, in real time until Ctrl-C.

    The UR5e listens as the real controller does: RTDE 30004, scripts 30003, dashboard 29999.
    """
    from drivers.clock import WallClock
    from rig.config_load import load_config, packaged_config
    from rig.stop_request import StopRequest
    from sim_backend.loopback_rig.rig import LoopbackRig

    name = "loopback_ur5e.yaml" if arm == "ur" else "loopback_gantry.yaml"
    path = packaged_config(name) if rig is None else rig
    config = load_config("sphere" if target == "board" else target, path, assignments)
    clock = WallClock()
    end_s = clock.now_s() + for_s
    with (
        StopRequest("ending …") as stop_requested,
        LoopbackRig(
            arm, config.sim, target, clock, host, link, port if camera else None, for_s, ur_version
        ) as served,
    ):
        stream = "" if served.stream is None else f", camera {served.stream.url}"
        warn(f"serving {arm} at {host if arm == 'ur' else link}{stream}; Ctrl-C ends it")
        while clock.now_s() < end_s and not stop_requested():
            if served.stream is not None and served.stream.error is not None:
                raise served.stream.error
            clock.sleep_until(clock.now_s() + 0.1)


@sim_app.command(epilog=WITH_DEVICE)
def fault(
    kind: Annotated[
        str,
        typer.Argument(
            help="UR: protective_stop, emergency_stop, program_stop, drop, stall. Gantry: alarm, "
            "door, hold, emergency_stop, reset, stall, drop. A name of the other arm stands for "
            "what comes nearest. Camera: camera_unplug, camera_freeze, camera_repeat. clear ends "
            "all of them."
        ),
    ],
    after: Annotated[float, typer.Option(min=0.0, help="Seconds from now.")] = 0.0,
    for_s: Annotated[
        float, typer.Option("--for", min=0.0, help="Seconds it lasts; 0: until cleared.")
    ] = 0.0,
    host: Host = "127.0.0.1",
) -> None:
    """Make the emulated rig at HOST fail."""
    from drivers.errors import ConfigError, ConnectError

    try:
        _order(host, kind, after, for_s)
    except OSError as error:
        raise ConnectError(
            f"no emulated rig answers at {host}: {error}; start one with `rig sim serve`"
        ) from error
    except ValueError as error:
        raise ConfigError(f"{error}; of the camera: {_CAMERA_FAULTS}") from error


def _order(host: str, kind: str, after_s: float, for_s: float) -> None:
    """Order a fault, or the nearest one that this arm has; raises what ``order`` raises."""
    from sim_backend.loopback_rig.orders import order

    if kind == "clear":
        order(host, {"do": "clear"})
        return
    times = {"after_s": after_s, "for_s": for_s}
    try:
        order(host, {"fault": kind, **times})
    except ValueError:
        if kind not in _NEAREST:
            raise
        order(host, {"fault": _NEAREST[kind], **times})
        warn(f"this arm has no {kind}: made it {_NEAREST[kind]}, which comes nearest")
