"""The channels of a log: names, schemas, encodings; one table, for writing and reading.

Numbers in JSON are written so that they read back to the same bits. Foxglove's own schemas are
protobuf, for what its panels and Rerun show by themselves.
"""

from dataclasses import dataclass, field
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

Schema = dict[str, Any]

_NUMBER: Schema = {"type": ["number", "null"]}
_TEXT: Schema = {"type": "string"}
_COUNT: Schema = {"type": "integer"}


def _array(*shape: int, optional: bool = False) -> Schema:
    """An array of numbers of a shape, or null."""
    inner = _NUMBER if len(shape) == 1 else _array(*shape[1:])
    kind: Any = ["array", "null"] if optional else "array"
    return {"type": kind, "items": inner, "minItems": shape[0], "maxItems": shape[0]}


def _object(description: str, **properties: Schema) -> Schema:
    """An object that says when it was true, and more."""
    t_s = {"type": "number", "description": "when it was true, seconds on the rig's clock"}
    return {
        "type": "object",
        "description": description,
        "properties": {"t_s": t_s, **properties},
        "required": ["t_s"],
    }


@dataclass(frozen=True, slots=True)
class Topic:
    """One channel; ``kind`` is what its records are called in exports."""

    kind: str
    name: str
    schema_name: str
    schema: Schema = field(default_factory=dict)  # JSON
    message: type[Any] | None = None  # protobuf, in the place of JSON

    @property
    def encoding(self) -> str:
        """Of its messages."""
        return "json" if self.message is None else "protobuf"


_ESTIMATE = _object(
    "The target in the camera's axes at t_s",
    s=_array(3),
    axis=_array(3, optional=True),
    chi={**_NUMBER, "description": "1/R, 1/m"},
    radius_m=_NUMBER,
    variance={**_NUMBER, "description": "of chi"},
    covariance={**_array(4, 4, optional=True), "description": "of (s, chi), updates only"},
    image_covariance={**_array(3, 3, optional=True), "description": "of s in the image"},
    doubt={**_TEXT, "description": "why images and motion contradict each other, or empty"},
    residual=_NUMBER,
    extrapolated_s=_NUMBER,
)
_TIME: Schema = {
    "type": "object",
    "title": "time",
    "properties": {"sec": _COUNT, "nsec": _COUNT},
}

TOPICS = (
    Topic(
        "arm",
        "/arm/state",
        "activerig.ArmState",
        _object(
            "One measured sample of the arm",
            read={**_COUNT, "description": "samples read together share it"},
            T_base_tool={**_array(3, 4), "description": "upper three rows"},
            twist_tool={**_array(6), "description": "measured, m/s and rad/s, tool axes"},
            t_std_s=_NUMBER,
            twist_covariance=_array(6, 6),
            twist_spectrum={**_array(6, 6), "description": "density of its error, m2/s and rad2/s"},
        ),
    ),
    Topic(
        "frame",
        "/camera/feature",
        "activerig.Feature",
        _object(
            "What was measured in one image; t_s is its stamp",
            handled_s={**_NUMBER, "description": "when the control loop had it"},
            seq=_COUNT,
            exposure_s=_NUMBER,
            stamp_source=_TEXT,
            height=_COUNT,
            width=_COUNT,
            reason={**_TEXT, "description": "why there is no feature, or empty"},
            s=_array(3, optional=True),
            covariance=_array(3, 3, optional=True),
            axis=_array(3, optional=True),
        ),
    ),
    Topic("update", "/estimate/update", "activerig.Estimate", _ESTIMATE),
    Topic("estimate", "/estimate/prediction", "activerig.Estimate", _ESTIMATE),
    Topic(
        "command",
        "/control/command",
        "activerig.Command",
        _object(
            "Tool twists (v, ω) in m/s and rad/s, tool axes",
            commanded=_array(6),
            allowed=_array(6),
            measured=_array(6),
            reasons={"type": "array", "items": _TEXT, "description": "why it was cut"},
        ),
    ),
    Topic(
        "tick",
        "/control/tick",
        "activerig.Tick",
        _object(
            "One tick of the control loop",
            late_s={**_NUMBER, "description": "after its grid point"},
            overruns={**_COUNT, "description": "grid points missed so far"},
        ),
    ),
    Topic(
        "event",
        "/events",
        "foxglove.Log",
        _object(
            "Something that happened",
            timestamp=_TIME,
            level={**_COUNT, "description": "2 info, 3 warning, 4 error"},
            message=_TEXT,
            name=_TEXT,
            file=_TEXT,
            line=_COUNT,
            event=_TEXT,
            detail=_TEXT,
        ),
    ),
    Topic("image", "/camera/image", "foxglove.CompressedImage", message=CompressedImage),
    Topic("raw_image", "/camera/image_raw", "foxglove.RawImage", message=RawImage),
    Topic(
        "calibration",
        "/camera/calibration",
        "foxglove.CameraCalibration",
        message=CameraCalibration,
    ),
    Topic("transforms", "/tf", "foxglove.FrameTransforms", message=FrameTransforms),
    Topic("target", "/target/pose", "foxglove.PoseInFrame", message=PoseInFrame),
)

BY_KIND = {topic.kind: topic for topic in TOPICS}
BY_NAME = {topic.name: topic for topic in TOPICS}
# What a person or a spreadsheet reads; the rest is for viewers.
RECORDS = tuple(topic.kind for topic in TOPICS if topic.message is None)
