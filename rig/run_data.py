"""A run as arrays: what the summary and the report are computed from."""

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, GreyImage
from estimator.augmented import ExtraState
from estimator.estimate import Estimate
from estimator.image.feature import Feature
from rig.config import TargetKind
from rig.frames import invert, twist_map

FloatArray = NDArray[np.float64]

# Memory is bounded: this many images are kept for the report, the newest always among them.
_SNAPSHOTS_KEPT = 6


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One image with the feature measured in it."""

    t_s: float
    image: GreyImage  # (height, width)
    feature: Feature


@dataclass(frozen=True, slots=True)
class ArmTrack:
    """The measured motion of the camera."""

    t_s: FloatArray  # (n,)
    T_base_camera: FloatArray  # (n, 4, 4)
    twist_camera: FloatArray  # (n, 6) in camera axes


@dataclass(frozen=True, slots=True)
class UpdateTrack:
    """The estimator's state at each image's exposure, after the image was used."""

    t_s: FloatArray  # (k,)
    chi: FloatArray  # (k,)
    s: FloatArray  # (k, 3)
    axis: FloatArray | None  # (k, 3), cylinder only
    residual: FloatArray  # (k,)
    variance: FloatArray | None  # (k,) of chi, where the estimator states it


@dataclass(slots=True)
class RunData:
    """Collects samples during a run; arrays are made once at the end."""

    target: TargetKind
    T_tool_camera: FloatArray  # (4, 4)
    arm_states: list[ArmState] = field(default_factory=list)
    updates: list[Estimate] = field(default_factory=list)
    features: list[Feature] = field(default_factory=list)  # one per update: what led to it
    snapshots: list[Snapshot] = field(default_factory=list)
    newest_snapshot: Snapshot | None = None
    # What the estimator found besides s and χ, at the time of asking.
    extra_states: Callable[[], tuple[ExtraState, ...]] = tuple
    camera_from_tool: FloatArray = field(init=False)  # (6, 6) maps the tool's twist
    frames: int = 0
    frames_lost: int = 0  # received, but without a trustworthy outline
    frames_dropped: int = 0  # gaps in the camera's sequence
    _last_seq: int | None = None
    _snapshot_stride: int = 1

    def __post_init__(self) -> None:
        self.camera_from_tool = twist_map(invert(self.T_tool_camera))

    def add_frame(self, seq: int, found: bool) -> None:
        """Count a received frame and the gap before it."""
        if self._last_seq is not None:
            self.frames_dropped += max(0, seq - self._last_seq - 1)
        self._last_seq = seq
        self.frames += 1
        self.frames_lost += not found

    def add_snapshot(self, snapshot: Snapshot) -> None:
        """Keep images spread evenly over the run so far, and the newest."""
        self.newest_snapshot = snapshot
        if len(self.updates) % self._snapshot_stride == 0:
            self.snapshots.append(snapshot)
        if len(self.snapshots) > _SNAPSHOTS_KEPT:
            self.snapshots = self.snapshots[::2]
            self._snapshot_stride *= 2

    def sigma2_at(self, index: int) -> float:
        """σ1² of the measured motion at the time of ``updates[index]``, (m/s)²."""
        update = self.updates[index]
        states = self.arm_states
        after = min(bisect_left(states, update.t_s, key=lambda s: s.t_s), len(states) - 1)
        nearest = min(states[max(after - 1, 0) : after + 1], key=lambda s: abs(s.t_s - update.t_s))
        v = (self.camera_from_tool @ nearest.twist_tool)[:3]
        along = 0.0 if update.axis is None else float(update.axis @ v)
        return max(float(v @ v) - along**2, 0.0)

    def doubts(self) -> list[str]:
        """Everything that the estimator found to contradict itself, in order."""
        return list(dict.fromkeys(update.doubt for update in self.updates if update.doubt))

    def arm_track(self) -> ArmTrack:
        """The camera's measured motion over the whole run."""
        twists = np.array([state.twist_tool for state in self.arm_states]).reshape(-1, 6)
        poses = np.array([state.T_base_tool for state in self.arm_states]).reshape(-1, 4, 4)
        return ArmTrack(
            t_s=np.array([state.t_s for state in self.arm_states]),
            T_base_camera=poses @ self.T_tool_camera,
            twist_camera=twists @ self.camera_from_tool.T,
        )

    def update_track(self) -> UpdateTrack:
        """The estimator's states, one per image used."""
        axes = [update.axis for update in self.updates if update.axis is not None]
        variances = [update.variance for update in self.updates if update.variance is not None]
        return UpdateTrack(
            t_s=np.array([update.t_s for update in self.updates]),
            chi=np.array([update.chi for update in self.updates]),
            s=np.array([update.s for update in self.updates]).reshape(-1, 3),
            axis=np.array(axes) if len(axes) == len(self.updates) and axes else None,
            residual=np.array([update.residual for update in self.updates]),
            variance=np.array(variances) if len(variances) == len(self.updates) else None,
        )
