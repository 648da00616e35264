"""What the vision process and the control process say to each other; one packet, one message.

The parent sends its ``Job`` and later ``BEGIN``; hanging up ends the child. The child answers
with the messages below, written as JSON, whose numbers survive unchanged.
"""

import json
from dataclasses import asdict, dataclass

import numpy as np

from drivers import errors
from drivers.errors import OperateError, RigError
from drivers.interfaces import Frame, GreyImage
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig, TargetKind
from rig.vision.sighting import Sighting

MOST_BYTES = 1 << 16
_MOST_TEXT = 8000  # characters of an error's words
BEGIN = b"begin"


@dataclass(frozen=True, slots=True)
class Job:
    """All that the child has to know."""

    config: RigConfig
    target: TargetKind
    intrinsics: Intrinsics

    def to_bytes(self) -> bytes:
        """The packet."""
        own = self.intrinsics
        values = [own.fx_px, own.fy_px, own.cx_px, own.cy_px, own.distortion.tolist()]
        fields = {"config": self.config.model_dump(mode="json"), "target": self.target}
        return json.dumps({**fields, "intrinsics": values}).encode()


def job_of(packet: bytes) -> Job:
    """The job in a packet."""
    fields = json.loads(packet)
    fx_px, fy_px, cx_px, cy_px, distortion = fields["intrinsics"]
    return Job(
        config=RigConfig.model_validate(fields["config"]),
        target=fields["target"],
        intrinsics=Intrinsics(fx_px, fy_px, cx_px, cy_px, np.array(distortion)),
    )


@dataclass(frozen=True, slots=True)
class Ready:
    """The camera is open and everything is compiled."""


@dataclass(frozen=True, slots=True)
class Images:
    """From now on images are in the ring whose file came with this message."""

    height: int
    width: int


@dataclass(frozen=True, slots=True)
class Idle:
    """No new frame came for a while; also a sign of life."""

    problem: str | None


@dataclass(frozen=True, slots=True)
class Failed:
    """The child cannot start or go on; ``kind`` is the name of an error of ``drivers.errors``."""

    kind: str
    text: str

    def error(self) -> RigError:
        """The error to raise here."""
        kind = getattr(errors, self.kind, OperateError)
        error = kind(self.text)
        return error if isinstance(error, RigError) else OperateError(self.text)


def failed(error: RigError) -> Failed:
    """The message for an error; subclasses that only a driver knows become what they are here."""
    kinds = (kind.__name__ for kind in type(error).__mro__ if kind.__module__ == errors.__name__)
    return Failed(next(kinds), str(error)[:_MOST_TEXT])


@dataclass(frozen=True, slots=True)
class Seen:
    """One frame, its image by number in the ring, and what was measured in it."""

    number: int
    t_exposure_mid_s: float
    exposure_s: float
    seq: int
    stamp_source: str
    reason: str
    s: list[float] | None
    covariance: list[list[float]] | None
    axis: list[float] | None

    def sighting(self, image: GreyImage) -> Sighting:
        """The sighting, given its image."""
        frame = Frame(image, self.t_exposure_mid_s, self.exposure_s, self.seq, self.stamp_source)
        if self.s is None:
            return Sighting(frame, Measurement(None, self.reason))
        axis = None if self.axis is None else np.array(self.axis)
        return Sighting(
            frame, Measurement(Feature(np.array(self.s), np.array(self.covariance), axis))
        )


def seen(sighting: Sighting, number: int) -> Seen:
    """The message for a sighting whose image has ``number``."""
    frame, feature = sighting.frame, sighting.measurement.feature
    return Seen(
        number=number,
        t_exposure_mid_s=frame.t_exposure_mid_s,
        exposure_s=frame.exposure_s,
        seq=frame.seq,
        stamp_source=frame.stamp_source,
        reason=sighting.measurement.reason,
        s=None if feature is None else feature.s.tolist(),
        covariance=None if feature is None else feature.covariance.tolist(),
        axis=None if feature is None or feature.axis is None else feature.axis.tolist(),
    )


Message = Ready | Images | Idle | Failed | Seen
_KINDS = {kind.__name__: kind for kind in (Ready, Images, Idle, Failed, Seen)}


def to_bytes(message: Message) -> bytes:
    """The packet."""
    return json.dumps([type(message).__name__, asdict(message)]).encode()


def message_of(packet: bytes) -> Message:
    """The message in a packet of the child."""
    kind, fields = json.loads(packet)
    message: Message = _KINDS[kind](**fields)
    return message
