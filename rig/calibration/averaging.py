"""Several images of a standing board as one view with less noise."""

from collections.abc import Sequence

import numpy as np

from rig.calibration.views import BoardView


def average_views(views: Sequence[BoardView]) -> BoardView:
    """Every corner that at least half of the views show, at its mean pixel.

    Raises ValueError without any view.
    """
    if not views:
        raise ValueError("no views to average")
    ids = np.concatenate([view.ids for view in views])
    points = np.concatenate([view.points_m for view in views])
    pixels = np.concatenate([view.pixels for view in views])
    numbers, first, counts = np.unique(ids, return_index=True, return_counts=True)
    kept = 2 * counts >= len(views)
    means = [pixels[ids == number].mean(axis=0) for number in numbers[kept]]
    return BoardView(numbers[kept], points[first[kept]], np.array(means).reshape(-1, 2))


def largest_motion_px(views: Sequence[BoardView]) -> float:
    """How far the corners' mean moved at most between two of the views; noise cancels in it.

    Only corners that all views show count; infinite when there are none.
    """
    common = set(views[0].ids.tolist()).intersection(*(view.ids.tolist() for view in views))
    if not common:
        return float("inf")
    wanted = np.array(sorted(common))
    middles = np.array([v.pixels[np.searchsorted(v.ids, wanted)].mean(axis=0) for v in views])
    apart = middles[:, None] - middles[None]
    return float(np.max(np.linalg.norm(apart, axis=2)))
