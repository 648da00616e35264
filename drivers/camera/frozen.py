"""Notices a source that sends one picture again and again as if it were new."""

import numpy as np

from drivers.camera.device import CameraLost
from drivers.interfaces import GreyImage


class FrozenCheck:
    """Counts successive pictures that are equal in every pixel, which a sensor's never are.

    A picture of one grey value does not count: without light there may be no noise either.
    """

    def __init__(self, limit: int | None) -> None:
        self._limit = limit
        self._last: GreyImage | None = None
        self._equal = 0

    def check(self, image: GreyImage) -> None:
        """Raises CameraLost at the ``limit``-th equal picture in a row, and at each that follows.

        A source that is still frozen when it is opened again is thus noticed at once.
        """
        last, self._last = self._last, image
        if self._limit is None:
            return
        if last is None or not np.array_equal(image, last) or image.min() == image.max():
            self._equal = 0
            return
        self._equal += 1
        if self._equal >= self._limit:
            raise CameraLost(
                f"frozen: {self._equal} pictures in a row were equal in every pixel "
                "(max_identical: null if this source has no noise)"
            )
