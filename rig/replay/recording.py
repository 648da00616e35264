"""A log as a replay needs it: what the run was, and what came in, in order."""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import yaml
from numpy.typing import NDArray

from drivers.errors import ConfigError
from drivers.interfaces import ArmState, Frame, GreyImage
from estimator.estimate import Estimate
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig, TargetKind
from rig.config_load import Tree, configured
from rig.log.header import CONFIG_NAME, LOG_FORMAT, PROGRAM, versions
from rig.log.reader import Log, Record, open_log
from rig.vision import Sighting

FloatArray = NDArray[np.float64]

_IMAGES = ("image", "raw_image")
_RECORDS = ("arm", "frame", "tick", "update", "estimate", "event")


@dataclass(frozen=True, slots=True)
class States:
    """Arm samples that were read at once."""

    states: list[ArmState]


@dataclass(frozen=True, slots=True)
class Seen:
    """An image as it was measured then; its pixels where they are asked for and recorded."""

    sighting: Sighting
    handled_s: float
    image: GreyImage | None


@dataclass(frozen=True, slots=True)
class Tick:
    """The estimator uses what came in and predicts to this instant."""

    t_s: float
    late_s: float
    overruns: int


@dataclass(frozen=True, slots=True)
class Estimated:
    """What the estimator said then."""

    kind: str  # "update" or "estimate"
    estimate: Estimate


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened."""

    t_s: float
    name: str
    detail: str


Step = States | Seen | Tick | Estimated | Event


@dataclass(frozen=True, slots=True)
class Recording:
    """One run's log, checked to be one that can be replayed."""

    log: Log
    version: str  # of the program that wrote it
    target: TargetKind
    tree: Tree  # the resolved configuration as recorded
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    renderer: str | None
    radius_true_m: float | None

    def config(self, assignments: list[str] | None = None) -> RigConfig:
        """The recorded configuration with ``a.b=value`` laid over; raises ConfigError."""
        where = f"{self.log.path}, recorded by {PROGRAM} {self.version} (this is "
        where += f"{versions()['version']}), has a configuration that does not fit"
        return configured(deepcopy(self.tree), assignments or [], where)

    def steps(self, images: bool) -> Iterator[Step]:
        """What happened, in the order the loop saw it; ``images`` decodes the pixels too."""
        batch: list[ArmState] = []
        read: int | None = None
        seen: Seen | None = None
        reader = _Arm()
        for record in self.log.records([*_RECORDS, *(_IMAGES if images else ())]):
            if record.kind in _IMAGES:
                if seen is not None:
                    yield Seen(seen.sighting, seen.handled_s, record.image())
                    seen = None
                continue
            values = record.values()
            if seen is not None:
                yield seen
                seen = None
            if batch and (record.kind != "arm" or values["read"] != read):
                yield States(batch)
                batch = []
            if record.kind == "arm":
                batch.append(reader.state(values))
                read = values["read"]
            elif record.kind == "frame":
                seen = _seen(values)
            else:
                yield _step(record, values)
        if batch:
            yield States(batch)
        if seen is not None:
            yield seen


class _Arm:
    """Arm samples; uncertainties are recorded only when they change."""

    def __init__(self) -> None:
        self._t_std_s: float | None = None
        self._twist_covariance: FloatArray | None = None
        self._twist_spectrum: FloatArray | None = None

    def state(self, values: dict[str, Any]) -> ArmState:
        self._t_std_s = values.get("t_std_s", self._t_std_s)
        if "twist_covariance" in values:
            self._twist_covariance = np.array(values["twist_covariance"])
        if "twist_spectrum" in values:
            self._twist_spectrum = np.array(values["twist_spectrum"])
        pose = np.eye(4)
        pose[:3] = values["T_base_tool"]
        twist = np.array(values["twist_tool"])
        known = self._t_std_s, self._twist_covariance, self._twist_spectrum
        return ArmState(values["t_s"], pose, twist, *known)


def open_recording(path: Path) -> Recording:
    """A run's log, or the one in a run directory.

    Raises ConfigError that names what is missing when it cannot be replayed.
    """
    log = open_log(path)
    program, run = log.metadata.get(PROGRAM), log.metadata_values("run")
    if program is None:
        raise ConfigError(f"{log.path} cannot be replayed: it is no log of {PROGRAM}")
    version = program.get("version", "an unknown version")
    if program.get("format") != str(LOG_FORMAT):
        raise ConfigError(
            f"{log.path} cannot be replayed: it has format {program.get('format')}, written by "
            f"{PROGRAM} {version}; this is {versions()['version']}, which reads format {LOG_FORMAT}"
        )
    geometry = log.metadata_values("geometry")
    missing = [name for name, there in (("run", run), ("geometry", geometry)) if not there]
    missing += [] if CONFIG_NAME in log.attachments else [CONFIG_NAME]
    if missing:
        raise ConfigError(f"{log.path} cannot be replayed: it lacks {', '.join(missing)}")
    target = run.get("target")
    if target not in get_args(TargetKind):
        raise ConfigError(
            f"{log.path} cannot be replayed: it looks at {target!r}, and this version knows "
            f"{', '.join(get_args(TargetKind))}"
        )
    fx_px, fy_px, cx_px, cy_px, *distortion = geometry["intrinsics"]
    return Recording(
        log=log,
        version=version,
        target=cast(TargetKind, target),
        tree=yaml.safe_load(log.attachments[CONFIG_NAME]),
        intrinsics=Intrinsics(fx_px, fy_px, cx_px, cy_px, np.array(distortion)),
        T_tool_camera=np.array(geometry["T_tool_camera"]),
        renderer=run.get("renderer"),
        radius_true_m=run.get("radius_true_m"),
    )


def _seen(values: dict[str, Any]) -> Seen:
    # As large as the image was, in no memory at all.
    blank = np.broadcast_to(np.uint8(0), (values["height"], values["width"]))
    frame = Frame(blank, values["t_s"], values["exposure_s"], values["seq"], values["stamp_source"])
    measurement = Measurement(None, values["reason"])
    if values["s"] is not None:
        axis = None if values["axis"] is None else np.array(values["axis"])
        measurement = Measurement(
            Feature(np.array(values["s"]), np.array(values["covariance"]), axis)
        )
    return Seen(Sighting(frame, measurement), values["handled_s"], None)


def _step(record: Record, values: dict[str, Any]) -> Step:
    if record.kind == "tick":
        return Tick(values["t_s"], values["late_s"], values["overruns"])
    if record.kind == "event":
        return Event(values["t_s"], values["event"], values["detail"])
    return Estimated(record.kind, _estimate(values))


def _estimate(values: dict[str, Any]) -> Estimate:
    # What was not finite was recorded as null.
    numbers = {key: _number(values[key]) for key in ("chi", "residual", "extrapolated_s")}
    return Estimate(
        t_s=values["t_s"],
        s=np.array(values["s"], dtype=float),
        axis=None if values["axis"] is None else np.array(values["axis"], dtype=float),
        chi=numbers["chi"],
        variance=values.get("variance"),
        residual=numbers["residual"],
        extrapolated_s=numbers["extrapolated_s"],
        covariance=_matrix(values, "covariance"),
        image_covariance=_matrix(values, "image_covariance"),
        doubt=values.get("doubt", ""),
    )


def _matrix(values: dict[str, Any], name: str) -> FloatArray | None:
    return None if values.get(name) is None else np.array(values[name], dtype=float)


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
