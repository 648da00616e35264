"""The log section: what of a run is recorded."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from rig.config_section import Section

ImageFormat = Literal["png", "jpeg", "raw", "off"]


def _off(value: object) -> object:
    """YAML 1.1 reads an unquoted ``off`` as false."""
    return "off" if value is False else value


class LogConfig(Section):
    """How images are recorded; everything else always is.

    png and raw keep every pixel, so that a replay from images repeats the run bit by bit.
    """

    images: Annotated[ImageFormat, BeforeValidator(_off)] = "png"
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 90
