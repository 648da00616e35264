"""The options of ``rig calibrate`` and of its steps, as one object."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from drivers.errors import ConfigError
from rig.commands.options import warn

if TYPE_CHECKING:
    from rig.calibration.result import CalibrationFile, Fingerprints
    from rig.config import RigConfig

Step = Literal["all", "intrinsics", "hand-eye", "latency", "verify"]
ON_EARLIER_DATA: tuple[Step, ...] = ("latency", "verify")
Realtime = Annotated[
    bool, typer.Option("--realtime", help="Run a simulated rig on the wall clock.")
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on with what an interrupted calibration collected.")
]
RollingShutter = Annotated[
    bool,
    typer.Option(
        "--rolling-shutter",
        help="Find the time from one image row to the next too (calibration.plan.rolling_shutter).",
    ),
]
FromImages = Annotated[
    Path | None,
    typer.Option(
        "--from-images",
        metavar="DIR",
        help="Intrinsics from the pictures in this folder; nothing is opened, nothing moves.",
    ),
]
Manual = Annotated[
    bool,
    typer.Option(
        "--manual",
        help="Move the arm by hand and press a key; it says what the next pose should add. "
        "Intrinsics and hand-eye.",
    ),
]
DryRun = Annotated[
    bool,
    typer.Option(
        "--dry-run",
        help="Plan and draw the poses as the simulated rig has them; nothing is opened, nothing "
        "moves.",
    ),
]


@dataclass(frozen=True, slots=True)
class Request:
    """What the command line asks for."""

    rig: Path | None
    assignments: tuple[str, ...]
    seed: int | None
    resume: bool
    realtime: bool
    as_json: bool
    from_images: Path | None
    manual: bool
    dry_run: bool
    rolling_shutter: bool = False

    def with_more(self, more: "Request") -> "Request":
        """Options may stand before the step and after it; what stands after goes before."""
        return Request(
            more.rig or self.rig,
            (*self.assignments, *more.assignments),
            self.seed if more.seed is None else more.seed,
            self.resume or more.resume,
            self.realtime or more.realtime,
            self.as_json or more.as_json,
            more.from_images or self.from_images,
            self.manual or more.manual,
            more.dry_run or self.dry_run,
            more.rolling_shutter or self.rolling_shutter,
        )

    def check(self, step: Step) -> None:
        """Raise ConfigError for options that do not go with the step or with each other."""
        modes = [
            name
            for name, given in (
                ("--from-images", self.from_images is not None),
                ("--manual", self.manual),
                ("--dry-run", self.dry_run),
            )
            if given
        ]
        if len(modes) > 1:
            raise ConfigError(f"{' and '.join(modes)} do not go together: choose one")
        if modes and step in ON_EARLIER_DATA:
            raise ConfigError(f"{modes[0]} does not go with `rig calibrate {step}`")
        if self.from_images is not None and step == "hand-eye":
            raise ConfigError(
                "--from-images finds the intrinsics only: where the camera sits on the tool takes "
                "the arm; run `rig calibrate intrinsics --from-images …`, then `rig calibrate "
                "hand-eye`"
            )

    def config(self) -> "RigConfig":
        """The rig's configuration."""
        from rig.config_load import load_config

        extra = [*self.assignments, *([] if self.seed is None else [f"sim.seed={self.seed}"])]
        extra += ["calibration.plan.rolling_shutter=true"] if self.rolling_shutter else []
        return load_config("sphere", self.rig, extra)


def instead_of(step: Step) -> str:
    """What to do where a step has nothing to go on with."""
    if step in ON_EARLIER_DATA:
        return "run `rig calibrate hand-eye` first, or `rig calibrate` for everything"
    return "leave --resume out to start anew"


def earlier(step: Step, path: Path, now: "Fingerprints") -> "CalibrationFile | None":
    """What a step goes on with; of a whole new calibration only intrinsics from pictures stay.

    Pictures taken in another mode of the camera or of another board do not count any more, nor
    do any where intrinsics are to be found with the arm. Raises ConfigError for a file that
    cannot be read.
    """
    from rig.calibration.result import load_calibration

    if not path.exists():
        return None
    if step != "all":
        return _without_old_pictures(step, load_calibration(path), now)
    try:
        found = load_calibration(path)
    except ConfigError:
        return None  # it will be replaced
    found = _without_old_pictures(step, found, now)
    if found.pictures is None:
        return None
    left = {"hand_eye": None, "latency": None, "verification": None, "verdict": None}
    return found.model_copy(update={**left, "intrinsics": found.pictures})


def _without_old_pictures(
    step: Step, found: "CalibrationFile", now: "Fingerprints"
) -> "CalibrationFile":
    lens = found.pictures
    if lens is None:
        return found
    changed = [key for key, then in lens.depends_on.items() if now.get(key) != then]
    if changed:
        warn(
            f"the intrinsics from pictures are not used: the {' and the '.join(changed)} changed "
            "since; take new pictures for `rig calibrate intrinsics --from-images`"
        )
    elif step != "intrinsics":
        return found
    return found.model_copy(update={"pictures": None})


def with_earlier(config: "RigConfig", step: Step, before: "CalibrationFile | None") -> "RigConfig":
    """``config`` that starts from what was found before, where that is better than nominal values.

    Intrinsics from pictures are, unless the rig file gives measured ones; steps that go on with
    earlier data take all that came of these.
    """
    from rig.calibrated import intrinsics_config

    if before is None:
        return config
    given, hand_eye = config.calibration, before.hand_eye
    goes_on = step in ON_EARLIER_DATA
    lens = before.intrinsics if goes_on else before.pictures
    found: dict[str, object] = {}
    if lens is not None and (goes_on or given.intrinsics is None):
        found["intrinsics"] = intrinsics_config(lens)
    if hand_eye is not None and goes_on:
        found["tool_camera_xyz_m"] = hand_eye.tool_camera_xyz_m
        found["tool_camera_rotvec_rad"] = hand_eye.tool_camera_rotvec_rad
    section = given.model_copy(update={"nominal": given.nominal.model_copy(update=found)})
    return config.model_copy(update={"calibration": section})
