"""``rig calibrate board``: the board to print, to scale, and its definition."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from rig.commands.options import warn

_MARKER = 0.733  # of a square's side, where none is given


def board(
    squares: Annotated[str, typer.Option(help="Squares in a row x in a column.")] = "7x5",
    square: Annotated[float, typer.Option(help="Side of a square, m.")] = 0.03,
    marker: Annotated[
        float | None, typer.Option(help="Side of a marker, m. By default 0.73 of a square's.")
    ] = None,
    dictionary: Annotated[str, typer.Option(help="OpenCV's name of the markers.")] = "DICT_4X4_50",
    paper: Annotated[
        Literal["a4", "a3", "letter"], typer.Option(help="The paper to print on.")
    ] = "a4",
    out: Annotated[Path, typer.Option(help="The PDF to write.")] = Path("board.pdf"),
) -> None:
    """Write the board as a PDF to print at 100 %, and its definition for the rig file."""
    from pydantic import ValidationError

    from drivers.errors import ConfigError
    from rig.calibration.board import BoardConfig
    from rig.calibration.board_pdf import board_pdf, definition

    columns, _, rows = squares.partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        raise ConfigError(f"--squares {squares}: two numbers like 7x5 are needed")
    try:
        config = BoardConfig(
            squares=(int(columns), int(rows)),
            square_m=square,
            marker_m=round(_MARKER * square, 4) if marker is None else marker,
            dictionary=dictionary,
        )
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ConfigError(f"this board cannot be: {why}") from error
    try:
        out.write_bytes(board_pdf(config, paper))
    except OSError as error:
        raise ConfigError(f"cannot write {out}: {error}") from error
    warn(f"{out}: print it at 100 %, measure the ruler, then put this into the rig file:")
    print(definition(config), end="")
