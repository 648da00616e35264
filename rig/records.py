"""The run directory: the resolved configuration, a log of every sample, the summary."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np

from drivers.clock import local_timestamp
from drivers.errors import ConfigError
from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from rig.background_file import BackgroundFile
from rig.config import RigConfig, TargetKind
from rig.config_load import dump_config
from rig.vision import Sighting

Json = float | int | str | bool | None | Sequence["Json"] | Mapping[str, "Json"]

LOG_NAME = "log.jsonl"
SUMMARY_NAME = "summary.json"

# One for all lines: json.dumps with options would make an encoder for each.
_encode = json.JSONEncoder(allow_nan=False, check_circular=False).encode


def make_run_dir(out: Path | None, target: TargetKind) -> Path:
    """Create the run's directory: ``out``, or a new dated one below ``runs/``.

    Raises ConfigError when it cannot be written or already holds a run.
    """
    path = _free_name(Path("runs") / f"{local_timestamp()}-{target}") if out is None else out
    try:
        path.mkdir(parents=True, exist_ok=out is not None)
        if (path / SUMMARY_NAME).exists() or (path / LOG_NAME).exists():
            raise ConfigError(f"{path} already holds a run: choose another --out")
        # Only tried: a run whose devices cannot be opened leaves nothing that blocks the next.
        (path / LOG_NAME).touch()
        (path / LOG_NAME).unlink()
    except OSError as error:
        raise ConfigError(f"cannot write the run directory {path}: {error}") from error
    return path


def make_figures_dir(out: Path | None, name: str) -> Path:
    """Create the directory of a set of figures: ``out``, or a new dated one below ``runs/``."""
    path = _free_name(Path("runs") / f"{local_timestamp()}-{name}") if out is None else out
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the directory {path}: {error}") from error
    return path


def _free_name(path: Path) -> Path:
    candidate, n = path, 2
    while candidate.exists():
        candidate, n = path.with_name(f"{path.name}-{n}"), n + 1
    return candidate


class RunLog:
    """Writes one JSON object a line, each with ``kind`` and the instant ``t_s`` it was true.

    Every value comes from the run's clock and devices, so that on simulated time the same seed
    writes the same bytes. ``in_background`` leaves the disk to a thread, for the wall clock.
    """

    def __init__(self, run_dir: Path, config: RigConfig, in_background: bool = False) -> None:
        (run_dir / "config.yaml").write_text(dump_config(config), encoding="utf-8")
        file = (run_dir / LOG_NAME).open("w", encoding="utf-8")
        self._file: IO[str] | BackgroundFile = BackgroundFile(file) if in_background else file

        self._t_std_s: float | None = None
        self._twist_std: np.ndarray | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()

    def arm(self, state: ArmState) -> None:
        """One measured arm sample; the pose as the upper three rows of ``T_base_tool``.

        Its uncertainties are written where the arm knows them, and only when they changed.
        """
        known: dict[str, Json] = {}
        if state.t_std_s is not None and state.t_std_s != self._t_std_s:
            known["t_std_s"] = self._t_std_s = state.t_std_s
        if state.twist_std is not None and state.twist_std is not self._twist_std:
            known["twist_std"], self._twist_std = state.twist_std.tolist(), state.twist_std
        self._write(
            "arm",
            state.t_s,
            T_base_tool=state.T_base_tool[:3].tolist(),
            twist_tool=state.twist_tool.tolist(),
            **known,
        )

    def frame(self, sighting: Sighting, handled_s: float) -> None:
        """One received image: its stamp, when it was handled, and what was measured in it."""
        frame, feature = sighting.frame, sighting.measurement.feature
        axis = None if feature is None or feature.axis is None else feature.axis.tolist()
        self._write(
            "frame",
            frame.t_exposure_mid_s,
            handled_s=handled_s,
            seq=frame.seq,
            exposure_s=frame.exposure_s,
            stamp_source=frame.stamp_source,
            reason=sighting.measurement.reason,
            s=None if feature is None else feature.s.tolist(),
            covariance=None if feature is None else feature.covariance.tolist(),
            axis=axis,
        )

    def estimate(self, kind: str, estimate: Estimate) -> None:
        """The state after an image (``kind`` update) or predicted to a tick (estimate)."""
        self._write(
            kind,
            estimate.t_s,
            s=estimate.s.tolist(),
            axis=None if estimate.axis is None else estimate.axis.tolist(),
            chi=estimate.chi,
            radius_m=estimate.radius_m,
            residual=estimate.residual,
            extrapolated_s=estimate.extrapolated_s,
        )

    def command(
        self,
        t_s: float,
        commanded: np.ndarray,
        allowed: np.ndarray,
        measured: np.ndarray,
        reasons: Sequence[str],
    ) -> None:
        """One tick's tool twists: asked for, allowed (with the reasons for any cut), measured."""
        self._write(
            "command",
            t_s,
            commanded=commanded.tolist(),
            allowed=allowed.tolist(),
            measured=measured.tolist(),
            reasons=list(reasons),
        )

    def event(self, t_s: float, name: str, detail: str = "") -> None:
        """Something that happened: started, target lost, stopped, …"""
        self._write("event", t_s, event=name, detail=detail)
        self._file.flush()

    def _write(self, kind: str, t_s: float, **values: Json) -> None:
        self._file.write(_encode({"kind": kind, "t_s": t_s, **values}) + "\n")


def write_summary(run_dir: Path, summary: Mapping[str, Json]) -> None:
    """Write ``summary.json``."""
    text = json.dumps(dict(summary), indent=2, allow_nan=False)
    (run_dir / SUMMARY_NAME).write_text(text + "\n", encoding="utf-8")
