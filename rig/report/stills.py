"""Selected images with the fitted outline, as data a page can embed."""

import base64
from dataclasses import dataclass

import cv2

from rig.outlined import outlined
from rig.recorded.record import RunRecord

_JPEG_QUALITY = 80
_SHOWN = 6


@dataclass(frozen=True, slots=True)
class Still:
    """One image of the page."""

    t_s: float  # since the first image used
    source: str  # a data: URL


def stills(record: RunRecord) -> list[Still]:
    """At most six images spread over the run, its newest among them."""
    pictures = record.pictures
    count = min(_SHOWN, len(pictures))
    chosen = [pictures[round(k * (len(pictures) - 1) / max(count - 1, 1))] for k in range(count)]
    out = []
    for picture in chosen:
        image = outlined(picture.load(), picture.feature, record.setup.intrinsics)
        ok, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        assert ok  # an image of this type always encodes
        text = base64.b64encode(jpeg.tobytes()).decode("ascii")
        out.append(Still(picture.t_s - record.start_s, f"data:image/jpeg;base64,{text}"))
    return out
