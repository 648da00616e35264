"""``rig calibrate --from-images``: the intrinsics part, from a folder of pictures."""

import json
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from rig.commands.calibrate_request import Request
from rig.commands.options import warn

if TYPE_CHECKING:
    from rig.calibration_run.from_images import FolderFit
    from rig.config import RigConfig


def calibrate_from_images(folder: Path, request: Request) -> None:
    """Fit, save as the calibration's intrinsics, and say what is still missing."""
    from drivers.clock import WallClock, local_timestamp
    from rig.calibration.detection import BoardDetector
    from rig.calibration.result import CalibrationFile, load_calibration, save_calibration
    from rig.calibration.result_check import judge
    from rig.calibration.result_make import intrinsics_result
    from rig.calibration_place import calibration_path
    from rig.calibration_run.from_images import fit_folder
    from rig.calibration_run.progress import ConsoleProgress
    from rig.calibration_run.summary import json_of, table
    from rig.fingerprints import fingerprints
    from rig.stop_request import StopRequest

    config, wall = request.config(), WallClock()
    path, board = calibration_path(config, request.rig), config.calibration.board
    before = load_calibration(path) if path.exists() else None
    console, start_s = Console(stderr=True), wall.now_s()
    with StopRequest("stopping …") as stop, ConsoleProgress(console) as progress:
        fit = fit_folder(folder, BoardDetector(board), _expected(config), progress, stop)
    now = fingerprints(config)
    section = intrinsics_result(fit.lens, fit.size, {key: now[key] for key in ("camera", "board")})
    section = section.model_copy(update={"from_images": True, "obtained": _how(fit, folder)})
    file = before or CalibrationFile(rig=config.name, made=local_timestamp(), board=board)
    changed = {"made": local_timestamp(), "board": board, "intrinsics": section}
    changed["pictures"] = section
    # What was fitted with other intrinsics does not go with these.
    file = file.model_copy(update={**changed, "hand_eye": None, "verification": None})
    file = file.model_copy(update={"verdict": judge(file, config.calibration.required)})
    save_calibration(file, path)
    summary = json_of((nan, nan), file, path, wall.now_s() - start_s)
    if request.as_json:
        print(json.dumps(summary), flush=True)
    console.print(table(summary))
    warn(f"{path}: holds the intrinsics; `rig calibrate hand-eye` goes on with them")


def _how(fit: "FolderFit", folder: Path) -> str:
    lens = fit.lens
    return (
        f"images: {len(lens.used)} of {fit.pictures} in {folder.resolve().name}, {lens.model.name}"
    )


def _expected(config: "RigConfig") -> tuple[int, int] | None:
    """The size that the rig's own camera is set to, where it says so."""
    camera = config.camera
    if camera.driver == "sim" or camera.width is None or camera.height is None:
        return None
    return camera.width, camera.height
