"""The report that every calibration leaves beside its file."""

from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.options import warn

if TYPE_CHECKING:
    from rig.calibration.result import CalibrationFile
    from rig.calibration_run.session import Session
    from rig.calibration_run.store import Store


def write_report_of(
    session: "Session", store: "Store", found: "CalibrationFile", path: Path
) -> str | None:
    """Write the report beside the calibration; where it is, None when that fails."""
    from rig.calibration_report.material import Material
    from rig.calibration_report.page import write_report

    material = Material(
        found,
        store.stills,
        session.geometry,
        store.recording,
        session.latency,
        session.verification,
    )
    try:
        page = write_report(path.with_name(f"{found.rig}-report"), material)
    except OSError as error:  # the result stands all the same
        warn(f"no report: {error}")
        return None
    warn(f"report: {page}")
    return str(page)
