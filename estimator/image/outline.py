"""The outline of a feature in pixels, for drawing: lens distortion included."""

import numpy as np

from estimator.image.edges_camera import pack_camera
from estimator.image.edges_cylinder import lines_of_cylinder
from estimator.image.feature import Feature
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.outline_normals import line_normals, sphere_normals

_POINTS = 180


def outline_px(
    feature: Feature, intrinsics: Intrinsics, shape: tuple[int, int]
) -> list[FloatArray]:
    """Polylines (n, 2) of pixels (u, v) in an image of ``shape`` (height, width).

    Sphere: one closed curve (its last point repeats the first), also where it leaves the image.
    Cylinder: the visible part of each of its two sides; fewer when a side is out of view.
    Raises ValueError when the camera is inside the target (|s| <= 1).
    """
    s = np.array(feature.s, dtype=float)
    if not float(s @ s) > 1.0:
        raise ValueError(f"|s| = {np.linalg.norm(s):.3f}: the camera would be inside the target")
    camera = pack_camera(intrinsics)
    if feature.axis is None:
        curve = sphere_normals(camera, s, _POINTS)[:, :2]
        return [np.concatenate([curve, curve[:1]])]
    height, width = shape
    sides = [
        line_normals(camera, n, _POINTS, width, height)[:, :2]
        for n in lines_of_cylinder(s, np.array(feature.axis, dtype=float))
    ]
    return [side for side in sides if len(side) > 0]
