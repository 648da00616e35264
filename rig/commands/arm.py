"""``rig arm``: look at an arm, jog it, stop it, bring it back, home it; no rig file needed."""

import json
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console

from rig.commands.arm_text import arm_table, jog_facts
from rig.commands.options import AsJson
from rig.exit_codes import MOVING, WITH_DEVICE, ExitCode

if TYPE_CHECKING:
    from rig.arm_kits import ArmKit
    from rig.config_safety import SafetyConfig
    from rig.jog import FloatArray

arm_app = typer.Typer(
    help="Look at an arm, jog it, stop it, bring it back, home it.", no_args_is_help=True
)
_FAR_M = 100.0

ArmName = Annotated[
    Literal["ur", "grbl", "sim"], typer.Option("--arm", help="The kind of arm.", show_default=False)
]
Host = Annotated[str | None, typer.Option(help="UR: the controller's address; no default.")]
Port = Annotated[str | None, typer.Option(help="Gantry: the serial device; no default.")]
Baud = Annotated[
    int | None, typer.Option(help="Gantry: the serial speed in bit/s; default: 115200.")
]
# As ``RigFile``, but a jog without one takes the arm as it comes.
JogRigFile = Annotated[
    Path | None,
    typer.Option("--rig", help="The rig's YAML file; default: none, the arm's own limits."),
]


@arm_app.command(epilog=WITH_DEVICE)
def status(
    arm: ArmName, host: Host = None, port: Port = None, baud: Baud = None, as_json: AsJson = False
) -> None:
    """Say how the arm is; nothing moves. Exit status 3 when something keeps it from moving."""
    from drivers.clock import WallClock

    facts = _kit(arm, host, port, baud).status(WallClock())
    if as_json:
        print(json.dumps(facts), flush=True)
    else:
        Console().print(arm_table("arm", facts))
    if facts["problem"] is not None:
        raise typer.Exit(ExitCode.DEVICE)


@arm_app.command(epilog=MOVING)
def jog(
    arm: ArmName,
    twist: Annotated[
        str, typer.Option(help="vx,vy,vz,wx,wy,wz in m/s and rad/s.", show_default=False)
    ],
    for_s: Annotated[
        float,
        typer.Option("--for", min=0.05, max=60.0, help="Seconds to move.", show_default=False),
    ],
    frame: Annotated[
        Literal["base", "tool"], typer.Option(help="The axes that the tool's twist is given in.")
    ] = "base",
    host: Host = None,
    port: Port = None,
    baud: Baud = None,
    rig: JogRigFile = None,
    as_json: AsJson = False,
) -> None:
    """Move the arm within the limits and report what it did; Ctrl-C stops it.

    With a rig file the arm is set up as there, and the limits are those of its `safety` section,
    the camera's distance to the table included; without one, its default speeds and
    accelerations hold, and no workspace. Exit status 5 when the program was held up meanwhile.
    """
    from drivers.clock import WallClock
    from rig.deadman import Deadman
    from rig.jog import HOLD_S
    from rig.jog import jog as run_jog
    from rig.remarks import delay_facts, tell_remarks
    from rig.stop_request import StopRequest

    wanted = _numbers(twist)
    kit = _kit(arm, host, port, baud, rig)
    safety = _limits(rig, kit.max_state_age_s)
    camera = None if rig is None else _camera_on_tool(rig)
    clock = WallClock()
    in_base = frame == "base"
    with StopRequest() as stop_requested:
        device = kit.open(clock)
        try:
            tell_remarks(device)
            with closing(Deadman(clock, HOLD_S, device.stop)) as deadman:
                result = run_jog(
                    device, clock, wanted, in_base, for_s, safety, stop_requested, camera, deadman
                )
            delay = delay_facts(device)
        finally:
            device.close()
    facts = {**jog_facts(result, frame), **delay}
    if as_json:
        print(json.dumps(facts), flush=True)
    else:
        Console().print(arm_table("jog", facts))
    if result.interrupted:
        raise typer.Exit(ExitCode.INTERRUPTED)


@arm_app.command(epilog=WITH_DEVICE)
def stop(arm: ArmName, host: Host = None, port: Port = None, baud: Baud = None) -> None:
    """Stop what the arm does now, whoever started it, and see it at rest. No emergency stop.

    Exit status 3 where it is not seen at rest. A gantry's port takes one program at a time: while
    another holds it, this cannot reach the gantry, and that program or the emergency stop must.
    """
    from drivers.clock import WallClock
    from rig.stop_request import StopRequest

    kit = _kit(arm, host, port, baud)
    with StopRequest("first the arm is stopped …") as interrupted:
        interrupted()  # from here on a signal no longer leaves at once: half a stop is none
        print(kit.stop(WallClock()))


@arm_app.command(epilog=WITH_DEVICE)
def recover(
    arm: ArmName,
    host: Host = None,
    port: Port = None,
    baud: Baud = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Explain why the arm stopped, ask, unlock it; no old motion resumes."""
    from drivers.clock import WallClock
    from rig.stop_request import StopRequest

    def confirm(explanation: str) -> bool:
        print(explanation)
        return yes or typer.confirm("Is everybody clear of the arm, and shall it be unlocked?")

    kit = _kit(arm, host, port, baud)
    with StopRequest():
        print(kit.recover(WallClock(), confirm))


@arm_app.command(epilog=WITH_DEVICE)
def home(
    arm: ArmName,
    host: Host = None,
    port: Port = None,
    baud: Baud = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Let a gantry find its zero at its switches; every axis moves. Ctrl-C stops it at once.

    So do a closed terminal and SIGTERM. Only a program that is killed (SIGKILL) cannot stop it:
    the controller then homes on by itself, until `rig arm stop` or the emergency stop.
    """
    from drivers.clock import WallClock
    from rig.stop_request import StopRequest

    def confirm(explanation: str) -> bool:
        print(explanation)
        return yes or typer.confirm("Is the whole way of every axis clear, and shall it move?")

    kit = _kit(arm, host, port, baud)
    with StopRequest():
        print(kit.home(WallClock(), confirm))


def _kit(
    arm: str, host: str | None, port: str | None, baud: int | None, rig: Path | None = None
) -> "ArmKit":
    from drivers.errors import ConfigError
    from rig.arm_kits import Address, arm_kit
    from rig.config_load import load_config

    settings = None if rig is None else load_config("sphere", rig).arm
    if settings is not None and settings.driver != arm:
        raise ConfigError(f"--arm {arm}, but {rig} has arm.driver = {settings.driver}")
    return arm_kit(arm, Address(host, port, baud, settings))


def _limits(rig: Path | None, max_state_age_s: float) -> "SafetyConfig":
    """The envelope, with room for the age that this arm's states normally have."""
    from rig.config_load import load_config
    from rig.config_safety import SafetyConfig

    if rig is None:
        # Where the base frame lies is the rig file's knowledge: without it, no box makes sense.
        anywhere_m = {"workspace_min_m": (-_FAR_M,) * 3, "workspace_max_m": (_FAR_M,) * 3}
        safety = SafetyConfig().model_copy(update=anywhere_m)
    else:
        safety = load_config("sphere", rig).safety
    oldest_s = max(safety.max_state_age_s, max_state_age_s)
    return safety.model_copy(update={"max_state_age_s": oldest_s})


def _camera_on_tool(rig: Path) -> "FloatArray | None":
    """T_tool_camera (4, 4), as far as it is known."""
    from drivers.errors import ConfigError
    from rig.calibrated import calibrated
    from rig.config_load import load_config
    from rig.given_values import hand_eye_of
    from rig.start_values import with_nominal

    config = load_config("sphere", rig)
    # What is out of date, or was given to begin with, keeps off the table better than nothing.
    with suppress(ConfigError):
        return hand_eye_of(calibrated(config, rig).config)
    return hand_eye_of(with_nominal(config))


def _numbers(text: str) -> Any:
    import numpy as np

    from drivers.errors import ConfigError

    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError as error:
        raise ConfigError(f"--twist {text!r}: {error}") from error
    if values.shape != (6,):
        raise ConfigError(f"--twist {text!r}: write it as vx,vy,vz,wx,wy,wz")
    return values
