"""Whether images agree with what was predicted of them, as well as they claim."""

from collections import deque

# The quantiles of chi squared that one exact image in ten thousand exceeds.
GATE = {2: 18.42, 3: 21.11}

# Images that the judgement is about; what they say is joined to this many that agree.
_IMAGES, _PRIOR_IMAGES = 60, 10
# So many rejected one after the other are no outliers.
_STREAK = 5
# Residuals twice as large as claimed happen on bad images; three times as large do not.
_DOUBTFUL = 9.0
_FEWEST = 5


class Innovations:
    """Follows the normalised innovations squared of the last images.

    ``factor`` is by how much variances are understated, as a least-squares fit is judged by its
    residuals: the mean over its expectation, at least 1. An image beyond the gate adds no more
    than the gate.
    """

    def __init__(self) -> None:
        self._ratios: deque[float] = deque(maxlen=_IMAGES)  # normalised by their expectation
        self._rejected: deque[bool] = deque(maxlen=_IMAGES)
        self.streak = 0  # rejected images up to now
        self.factor = 1.0

    def admits(self, nis: float, dof: int) -> bool:
        """Whether an image with this innovation is to be used; takes note of it."""
        limit = GATE[dof] * self.factor
        admitted = nis <= limit
        self._ratios.append(nis / dof)
        self._rejected.append(not admitted)
        self.streak = 0 if admitted else self.streak + 1
        capped = sum(min(ratio, GATE[dof] / dof) for ratio in self._ratios)
        self.factor = max(1.0, (_PRIOR_IMAGES + capped) / (_PRIOR_IMAGES + len(self._ratios)))
        return admitted

    @property
    def persistent(self) -> bool:
        """Whether so many images in a row were rejected that the prediction must be wrong."""
        return self.streak >= _STREAK

    def restarted(self) -> None:
        """The prediction starts anew."""
        self.streak = 0

    @property
    def doubt(self) -> str:
        """What is wrong, in words; "" when nothing is."""
        count = len(self._ratios)
        if count < _FEWEST:
            return ""
        typical = sorted(self._ratios)[count // 2]
        rejected = sum(self._rejected)
        if typical <= _DOUBTFUL and rejected <= max(count // 4, _FEWEST - 1):
            return ""
        return (
            "the images contradict the motion: the target moves, the latency is wrong, "
            "or the calibration is"
        )
