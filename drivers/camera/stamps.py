"""Which instant a frame was true, and whether its own stamp may be believed.

A stamp is believed when it is strictly increasing and no more than one period in the future
nor older than the age limit. Once a source's stamps have been believed, a frame that repeats
one or carries an old one is not a new exposure and is refused; giving it the time of its
arrival instead would make a frozen picture look fresh.
"""

from dataclasses import dataclass

from drivers.camera.device import Grab

HOST = "host"


@dataclass(frozen=True, slots=True)
class Stamp:
    """The instant of mid-exposure and where it comes from."""

    t_exposure_mid_s: float
    exposure_s: float
    source: str  # "kernel", "stream" or "host"


class Stamper:
    """Stamps the grabs of one camera, over all its re-openings."""

    def __init__(
        self, period_s: float, max_age_s: float, transfer_s: float, assumed_exposure_s: float
    ) -> None:
        self._period_s = period_s
        self._max_age_s = max_age_s
        self._transfer_s = transfer_s
        self._assumed_exposure_s = assumed_exposure_s
        self._last_stamp_s: float | None = None  # newest believed one
        self._last_mid_s = -float("inf")

    @property
    def trusted(self) -> bool:
        """Whether this source's own stamps have been believed before."""
        return self._last_stamp_s is not None

    def use_period(self, period_s: float) -> None:
        """Replace the nominal period by the measured one."""
        self._period_s = period_s

    def stamp(
        self, grab: Grab, source: str, mid_exposure: bool, exposure_s: float | None
    ) -> Stamp | str:
        """The frame's stamp, or in words why the frame is not a new one.

        ``source`` names the device's stamps, ``mid_exposure`` says what they mark,
        ``exposure_s`` is what the device told about its exposure at set-up.
        """
        exposure_s = next(
            (e for e in (grab.exposure_s, exposure_s) if e is not None), self._assumed_exposure_s
        )
        if grab.stamp_s is not None and self._believable(grab.stamp_s, grab.returned_s):
            self._last_stamp_s = grab.stamp_s
            after_mid_s = 0.0 if mid_exposure else self._transfer_s + exposure_s / 2
            return self._in_order(Stamp(grab.stamp_s - after_mid_s, exposure_s, source))
        if grab.stamp_s is not None and self._last_stamp_s is not None:
            age_s = grab.returned_s - grab.stamp_s
            if grab.stamp_s == self._last_stamp_s:
                return "the same picture was delivered again"
            if grab.stamp_s < self._last_stamp_s:
                return f"a picture from {self._last_stamp_s - grab.stamp_s:.3f} s earlier came late"
            if age_s >= self._max_age_s:
                return f"the picture was {age_s:.3f} s old on arrival"
        mid_s = grab.returned_s - self._transfer_s - exposure_s / 2
        return self._in_order(Stamp(mid_s, exposure_s, HOST))

    def _believable(self, stamp_s: float, returned_s: float) -> bool:
        if self._last_stamp_s is not None and stamp_s <= self._last_stamp_s:
            return False
        return -self._period_s <= returned_s - stamp_s < self._max_age_s

    def _in_order(self, stamp: Stamp) -> Stamp | str:
        if stamp.t_exposure_mid_s <= self._last_mid_s:
            return "the picture is not newer than the one before"
        self._last_mid_s = stamp.t_exposure_mid_s
        return stamp
