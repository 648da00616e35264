"""Where a rig's calibration is: beside its rig file, so that it is found from any directory."""

from pathlib import Path

from rig.config import RigConfig
from rig.config_load import packaged_config


def calibration_path(config: RigConfig, rig_file: Path | None = None) -> Path:
    """Where the rig's calibration is, or will be.

    ``calibration.file``, or ``calibration/<name>.yaml``, below the folder of ``rig_file``; where
    there is none but one below the working directory, that one. For the rig files that come with
    the program it is the working directory alone.
    """
    name = Path(config.calibration.file or f"calibration/{config.name}.yaml")
    packaged = packaged_config("sim.yaml").resolve().parent
    if rig_file is None or rig_file.resolve().parent == packaged:
        return name
    beside = rig_file.parent / name
    return name if name.exists() and not beside.exists() else beside
