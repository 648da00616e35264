"""Foxglove's messages from the rig's data: images, calibration, frames, the target's pose."""

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.estimate import Estimate
from estimator.image.intrinsics import Intrinsics

FloatArray = NDArray[np.float64]

BASE, TOOL, CAMERA = "base", "tool", "camera"


def timestamp(t_ns: int) -> Timestamp:
    """The instant in protobuf's words."""
    return Timestamp(seconds=t_ns // 10**9, nanos=t_ns % 10**9)


def calibration(own: Intrinsics, shape: tuple[int, ...], t_ns: int) -> CameraCalibration:
    """The camera's internal geometry; ``shape`` is (height, width)."""
    K = [own.fx_px, 0.0, own.cx_px, 0.0, own.fy_px, own.cy_px, 0.0, 0.0, 1.0]
    return CameraCalibration(
        timestamp=timestamp(t_ns),
        frame_id=CAMERA,
        width=shape[1],
        height=shape[0],
        distortion_model="plumb_bob",
        D=own.distortion.tolist(),
        K=K,
        R=np.eye(3).ravel().tolist(),
        P=[*K[:3], 0.0, *K[3:6], 0.0, *K[6:], 0.0],
    )


def transforms(T_base_tool: FloatArray, T_tool_camera: FloatArray, t_ns: int) -> FrameTransforms:
    """Where the tool is in the base, and the camera on the tool."""
    return FrameTransforms(
        transforms=[
            _transform(BASE, TOOL, T_base_tool, t_ns),
            _transform(TOOL, CAMERA, T_tool_camera, t_ns),
        ]
    )


def target_pose(estimate: Estimate, t_ns: int) -> PoseInFrame | None:
    """The target's P0 in the camera's axes, a cylinder's axis along z; None without a radius."""
    radius_m = estimate.radius_m
    if radius_m is None or not np.isfinite(radius_m):
        return None
    rotation = np.array([0.0, 0.0, 0.0, 1.0])
    if estimate.axis is not None:
        rotation = Rotation.align_vectors(estimate.axis[None], np.array([[0.0, 0.0, 1.0]]))[
            0
        ].as_quat()
    P0 = estimate.s * radius_m
    return PoseInFrame(timestamp=timestamp(t_ns), frame_id=CAMERA, pose=_pose(P0, rotation))


def _transform(parent: str, child: str, T: FloatArray, t_ns: int) -> FrameTransform:
    pose = _pose(T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat())
    return FrameTransform(
        timestamp=timestamp(t_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=pose.position,
        rotation=pose.orientation,
    )


def _pose(p: FloatArray, q: FloatArray) -> Pose:
    """From a position (3,) in m and a quaternion (4,), scalar last."""
    return Pose(
        position=Vector3(x=float(p[0]), y=float(p[1]), z=float(p[2])),
        orientation=Quaternion(x=float(q[0]), y=float(q[1]), z=float(q[2]), w=float(q[3])),
    )
