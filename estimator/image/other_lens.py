"""What the same outline in the image says about the target when the lens is taken for another.

Only the camera's intrinsics decide how pixels become rays. So the outline that one lens gives
for a feature, its pixels read through another lens, tells how the feature moves with them.
"""

import numpy as np

from estimator.image.intrinsics import FloatArray, Intrinsics

_RAYS = 64
_FEW = 5  # rays in view: fewer do not tell, and the feature stays
_AHEAD = np.array([0.0, 0.0, 1.0])
_REACH = 1.5  # half the length of a cylinder's side that is looked at, in distances


def through_other_lens(
    s: FloatArray,
    axis: FloatArray | None,
    lens: Intrinsics,
    other: Intrinsics,
    size: tuple[int, int],
) -> tuple[FloatArray, FloatArray | None]:
    """Features (k, 3) and axes (k, 3) measured with ``lens`` as ``other`` would have measured them.

    ``axis`` is None for a sphere; the image has ``size`` (width, height). The outline is fitted
    by its rays' directions, all weighted alike. Needs |s| > 1.
    """
    if axis is None:
        rays = _cone_rays(s)
        seen = _inside(rays, lens, size)
        return _sphere(_again(rays, seen, lens, other), seen, s), None
    side = np.cross(s, axis) * np.sqrt(np.sum(s**2, axis=1) - 1.0)[:, None]
    ss = np.sum(s**2, axis=1)[:, None]
    normals = []
    for n in ((s - side) / ss, (s + side) / ss):
        rays = _plane_rays(s, axis, n)
        seen = _inside(rays, lens, size)
        normals.append(_plane(_again(rays, seen, lens, other), seen, n))
    middle = 0.5 * (normals[0] + normals[1])
    along = np.cross(normals[0], normals[1])
    along *= np.sign(np.sum(along * axis, axis=1))[:, None]
    return (
        middle / np.sum(middle**2, axis=1)[:, None],
        along / np.linalg.norm(along, axis=1)[:, None],
    )


def _cone_rays(s: FloatArray) -> FloatArray:
    """Rays (k, n, 3) that touch the unit spheres around s (k, 3)."""
    distance = np.linalg.norm(s, axis=1)[:, None]
    e = s / distance
    # Any direction that is not along s; cameras look along z.
    b1 = np.cross(e, np.where(np.abs(e[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    b1 /= np.linalg.norm(b1, axis=1)[:, None]
    b2 = np.cross(e, b1)
    phi = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)[:, None]
    around = np.cos(phi) * b1[:, None] + np.sin(phi) * b2[:, None]
    sine = (1.0 / distance)[:, None]
    return np.asarray(np.sqrt(1.0 - sine**2) * e[:, None] + sine * around)


def _sphere(rays: FloatArray, seen: FloatArray, near: FloatArray) -> FloatArray:
    """s (k, 3) of the spheres that the unit rays r (k, n, 3) touch: r·m = 1, cos θ = 1/|m|."""
    normal = np.einsum("kn,kni,knj->kij", seen, rays, rays)
    right = np.einsum("kn,kni->ki", seen, rays)
    few = seen.sum(axis=1) < _FEW
    normal[few], right[few] = np.eye(3), 1.0
    m = np.linalg.solve(normal, right[..., None])[..., 0]
    s = m / np.sqrt(np.sum(m**2, axis=1) - 1.0)[:, None]
    return np.where(few[:, None], near, s)


def _plane_rays(s: FloatArray, axis: FloatArray, n: FloatArray) -> FloatArray:
    """Rays (k, n, 3) in the tangent planes with normals n (k, 3), along the cylinder's sides."""
    foot = s - n * np.sum(s * n, axis=1)[:, None]
    t = np.linspace(-_REACH, _REACH, _RAYS)[:, None] * np.linalg.norm(s, axis=1)[:, None, None]
    return np.asarray(foot[:, None] + t * axis[:, None])


def _inside(rays: FloatArray, lens: Intrinsics, size: tuple[int, int]) -> FloatArray:
    """1 for the rays (k, n, 3) that fall into the image, else 0."""
    # Wide of the image a lens' polynomial means nothing: looked at no further than its corner.
    corners = lens.normalise(np.array([[0, 0], [size[0] - 1, 0], [0, size[1] - 1], size]))
    widest = 1.1 * float(np.linalg.norm(corners, axis=1).max())
    near = rays[..., 2] * widest > np.linalg.norm(rays[..., :2], axis=2)
    pixels = lens.project(np.where(near[..., None], rays, _AHEAD))
    within = np.all((pixels > -0.5) & (pixels < np.array(size) - 0.5), axis=2)
    return np.asarray(within & near, dtype=float)


def _plane(rays: FloatArray, seen: FloatArray, near: FloatArray) -> FloatArray:
    """Unit normals (k, 3) of the planes through the rays (k, n, 3); ``near`` where none is seen."""
    scatter = np.einsum("kn,kni,knj->kij", seen, rays, rays)
    n = np.linalg.eigh(scatter)[1][..., 0]
    n = n * np.sign(np.sum(n * near, axis=1))[:, None]
    return np.where((seen.sum(axis=1) < _FEW)[:, None], near, n)


def _again(rays: FloatArray, seen: FloatArray, lens: Intrinsics, other: Intrinsics) -> FloatArray:
    """Unit rays (k, n, 3) through ``other`` of the pixels that ``lens`` gives for those seen."""
    xy = other.normalise(lens.project(np.where(seen[..., None] > 0.0, rays, _AHEAD)))
    out = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1)
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))
