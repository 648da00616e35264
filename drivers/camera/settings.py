"""What can be configured about a camera; validated before anything is opened."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Pixels = Annotated[int, Field(ge=1, le=16384)]
RequestName = Literal[
    "fourcc", "size", "rate", "exposure", "gain", "focus", "white_balance", "power_line"
]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class CameraControls(_Section):
    """What the camera is told to hold still; None leaves a control as it is."""

    exposure_ms: Positive | None = None  # switches automatic exposure off
    gain: int | None = None  # the driver's own scale; switches automatic gain off
    focus: int | None = None  # the driver's own scale; switches autofocus off
    white_balance_k: Annotated[int, Field(ge=1000, le=20000)] | None = None
    power_line: Literal["off", "50hz", "60hz", "auto"] | None = None


class CameraSettings(_Section):
    """One camera: where its images come from, what it must do, and when to distrust it."""

    # Index, /dev/videoN, /dev/v4l/by-id/..., http:// or rtsp:// URL, video file, image folder
    # or glob. A by-id name survives replugging; a number does not.
    source: int | str = 0

    # The requested mode; None takes what the source gives.
    width: Pixels | None = None
    height: Pixels | None = None
    rate_hz: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    fourcc: Annotated[str, Field(min_length=4, max_length=4)] | None = None
    buffers: Annotated[int, Field(ge=1, le=32)] = 2
    controls: CameraControls = CameraControls()
    # Requests that may fail with a recorded warning instead of an error.
    optional: tuple[RequestName, ...] = ()
    access: Literal["auto", "opencv", "linuxpy"] = "auto"  # auto: linuxpy where installed

    # From the end of the exposure to the stamp, calibrated per camera: readout and transfer.
    transfer_s: NotNegative = 0.0
    # Used where neither the camera nor ``controls`` tells the exposure time.
    assumed_exposure_s: NotNegative = 0.0

    max_age_s: Positive = 0.5  # an older frame is never returned
    select_timeout_s: Annotated[int, Field(ge=1, le=60)] = 1  # OpenCV knows whole seconds only
    rate_check_s: NotNegative = 2.0  # how long the rate is measured at open; 0: not at all
    rate_tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05

    first_backoff_s: Positive = 0.2  # before the first attempt to open again, then doubled
    max_backoff_s: Positive = 5.0
    give_up_after_s: Positive | None = 30.0  # without a frame; None: never
    # So many equal pictures in a row are a frozen camera (sensors have noise); None: no check.
    max_identical: Annotated[int, Field(ge=2)] | None = 30

    loop: bool = False  # files and folders: start again at the end

    @model_validator(mode="after")
    def _size_whole(self) -> Self:
        if (self.width is None) != (self.height is None):
            raise ValueError("width and height go together: give both")
        return self
