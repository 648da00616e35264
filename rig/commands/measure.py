"""``rig measure``: the features of a target in image files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rig.commands.options import Target
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.measure import ImageResult


def measure(
    images: Annotated[
        list[Path], typer.Argument(help="Image files, measured in this order.", show_default=False)
    ],
    target: Target,
    intrinsics: Annotated[
        str,
        typer.Option(
            metavar="FILE|fx,fy,cx,cy[,k1,k2,p1,p2,k3]",
            help="The camera: numbers in px (pixel centres at integers), or a YAML file with "
            "fx, fy, cx, cy and, if any, distortion: [k1, k2, p1, p2, k3], at the top level or "
            "under intrinsics.",
        ),
    ],
    method: Annotated[
        Literal["limb", "moments"],
        typer.Option(help="limb: the outline's pixels; moments: threshold and area, sphere only."),
    ] = "limb",
    sequence: Annotated[
        bool, typer.Option("--sequence", help="Track from image to image.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object per image and line.")
    ] = False,
) -> None:
    """Measure s = P0 / R of a sphere or cylinder in images.

    With --json each line holds: image, found, reason (null when found), s, axis (cylinder only),
    s_std (standard deviations of s; s, axis and s_std are null when not found) and cpu_ms (of this
    image's measurement on one thread, without reading the file). Colour is converted to grey,
    16-bit images are scaled to 8.

    Exit codes: 0 all images were read, whether or not the target is in them; 2 a wrong option, or a
    file that is missing or no image (nothing is measured then). An image that turns out to be
    damaged is reported as not found, the others are still measured, and the exit code is 2.
    """
    from rig.measure import measure_files

    damaged = False
    for result in measure_files(images, target, intrinsics, method, sequence):
        _show(result, target, as_json)
        damaged = damaged or not result.decoded
    if damaged:
        raise typer.Exit(ExitCode.CONFIG)


def _show(result: "ImageResult", target: Literal["sphere", "cylinder"], as_json: bool) -> None:
    from rig.measure import json_line, text_line

    typer.echo(json_line(result, target) if as_json else text_line(result))
    if not result.decoded:
        typer.echo(f"error: {result.measurement.reason}", err=True)
