"""From what the loop hands over to messages: bytes, their channel, and the instants they carry."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from drivers.interfaces import ArmState
from estimator.image.intrinsics import Intrinsics
from rig.config_log import LogConfig
from rig.log import viewers
from rig.log.entry import (
    Commanded,
    Entry,
    Estimated,
    Happened,
    Picture,
    Seen,
    States,
    Ticked,
)
from rig.log.pixels import image_message

FloatArray = NDArray[np.float64]

_ERRORS = ("state fault",)
_WARNINGS = ("overrun", "target lost", "stale image", "state holding", "estimator restarted")


@dataclass(frozen=True, slots=True)
class Message:
    """What goes into the file."""

    kind: str  # of rig.log.topics
    t_ns: int  # when it was true
    data: bytes


class Encoder:
    """Makes messages; ``offset_ns`` is what the rig's clock is behind the time of day by."""

    def __init__(
        self,
        config: LogConfig,
        intrinsics: Intrinsics,
        T_tool_camera: FloatArray,
        offset_ns: int = 0,
    ) -> None:
        self._config = config
        self._intrinsics = intrinsics
        self._T_tool_camera = T_tool_camera
        self._offset_ns = offset_ns
        self._newest: ArmState | None = None
        self._t_std_s: float | None = None
        self._twist_covariance: FloatArray | None = None
        self._shape: tuple[int, ...] | None = None

    def ns(self, t_s: float) -> int:
        """An instant of the rig's clock in the file's unit; never negative, as the file wants."""
        return max(0, self._offset_ns + round(t_s * 1e9))

    def messages(self, entry: Entry) -> Iterator[Message]:
        """The messages of one entry; an attachment has none."""
        if isinstance(entry, States):
            yield from self._arm(entry)
        elif isinstance(entry, Seen):
            yield from self._seen(entry)
        elif isinstance(entry, Picture):
            yield self._image(entry)
        elif isinstance(entry, Estimated):
            yield from self._estimated(entry)
        elif isinstance(entry, Commanded):
            yield self._json(
                "command",
                entry.t_s,
                commanded=entry.commanded.tolist(),
                allowed=entry.allowed.tolist(),
                measured=entry.measured.tolist(),
                reasons=list(entry.reasons),
            )
        elif isinstance(entry, Ticked):
            yield self._json("tick", entry.t_s, late_s=entry.late_s, overruns=entry.overruns)
        elif isinstance(entry, Happened):
            yield self._event(entry)

    def _arm(self, entry: States) -> Iterator[Message]:
        """Uncertainties are written where the arm knows them, and only when they changed."""
        for state in entry.states:
            known: dict[str, Any] = {}
            if state.t_std_s is not None and state.t_std_s != self._t_std_s:
                known["t_std_s"] = self._t_std_s = state.t_std_s
            covariance = state.twist_covariance
            if covariance is not None and covariance is not self._twist_covariance:
                known["twist_covariance"] = covariance.tolist()
                if state.twist_spectrum is not None:
                    known["twist_spectrum"] = state.twist_spectrum.tolist()
                self._twist_covariance = covariance
            yield self._json(
                "arm",
                state.t_s,
                read=entry.read,
                T_base_tool=state.T_base_tool[:3].tolist(),
                twist_tool=state.twist_tool.tolist(),
                **known,
            )
            self._newest = state

    def _seen(self, entry: Seen) -> Iterator[Message]:
        frame, feature = entry.sighting.frame, entry.sighting.measurement.feature
        t_s, shape = frame.t_exposure_mid_s, frame.image.shape
        if shape != self._shape:
            self._shape = shape
            lens = viewers.calibration(self._intrinsics, shape, self.ns(t_s))
            yield Message("calibration", self.ns(t_s), lens.SerializeToString())
        axis = None if feature is None or feature.axis is None else feature.axis.tolist()
        yield self._json(
            "frame",
            t_s,
            handled_s=entry.handled_s,
            seq=frame.seq,
            exposure_s=frame.exposure_s,
            stamp_source=frame.stamp_source,
            height=shape[0],
            width=shape[1],
            reason=entry.sighting.measurement.reason,
            s=None if feature is None else feature.s.tolist(),
            covariance=None if feature is None else feature.covariance.tolist(),
            axis=axis,
        )
        if self._newest is not None:  # as often as there are images is often enough to look at
            t_ns = self.ns(self._newest.t_s)
            tf = viewers.transforms(self._newest.T_base_tool, self._T_tool_camera, t_ns)
            yield Message("transforms", t_ns, tf.SerializeToString())

    def _image(self, entry: Picture) -> Message:
        t_ns = self.ns(entry.frame.t_exposure_mid_s)
        message = image_message(entry.frame.image, self._config, t_ns)
        kind = "raw_image" if self._config.images == "raw" else "image"
        return Message(kind, t_ns, message.SerializeToString())

    def _estimated(self, entry: Estimated) -> Iterator[Message]:
        estimate = entry.estimate
        known: dict[str, Any] = {}
        if entry.kind == "update":  # a prediction's follow from it
            for name in ("covariance", "image_covariance"):
                matrix = getattr(estimate, name)
                known |= {} if matrix is None else {name: matrix.tolist()}
        yield self._json(
            entry.kind,
            estimate.t_s,
            s=estimate.s.tolist(),
            axis=None if estimate.axis is None else estimate.axis.tolist(),
            chi=estimate.chi,
            radius_m=estimate.radius_m,
            variance=estimate.variance,
            residual=estimate.residual,
            extrapolated_s=estimate.extrapolated_s,
            doubt=estimate.doubt,
            **known,
        )
        if entry.kind == "update":
            t_ns = self.ns(estimate.t_s)
            pose = viewers.target_pose(estimate, t_ns)
            if pose is not None:
                yield Message("target", t_ns, pose.SerializeToString())

    def _event(self, entry: Happened) -> Message:
        t_ns = self.ns(entry.t_s)
        level = 4 if entry.name in _ERRORS else 3 if entry.name in _WARNINGS else 2
        return self._json(
            "event",
            entry.t_s,
            timestamp={"sec": t_ns // 10**9, "nsec": t_ns % 10**9},
            level=level,
            message=f"{entry.name}: {entry.detail}" if entry.detail else entry.name,
            name="rig",
            file="",
            line=0,
            event=entry.name,
            detail=entry.detail,
        )

    def _json(self, kind: str, t_s: float, **values: Any) -> Message:
        # orjson: the standard library takes 30 times as long, while it holds up the loop; what
        # JSON has no word for (an estimate that ran away) becomes null.
        data = orjson.dumps({"t_s": t_s, **values}, option=orjson.OPT_SERIALIZE_NUMPY)
        return Message(kind, self.ns(t_s), data)
