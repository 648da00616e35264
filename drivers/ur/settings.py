"""What can be set about a Universal Robots arm; validated before anything is opened."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]


class UrSettings(BaseModel):
    """The arm's address, how it is commanded, and what must be true about it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    host: Annotated[str, Field(min_length=1)]
    # The last twist, turned with the tool, goes out again this often between two commands.
    resend_period_s: Annotated[float, Field(ge=0.002, le=0.02)] = 0.004
    # Tool acceleration of speedL (m/s², and rad/s² for its rotation); above what the rig's own
    # limiter uses, so that the controller follows the commands instead of reshaping them.
    acceleration_m_s2: Annotated[float, Field(gt=0.01, le=15.0)] = 4.0
    stop_acceleration_m_s2: Annotated[float, Field(gt=0.01, le=15.0)] = 5.0
    # The controller itself stops the program when no command arrived for 1 / this.
    watchdog_hz: Annotated[float, Field(ge=5.0, le=100.0)] = 10.0
    # Newest state older than this: the connection counts as stalled.
    max_state_age_s: Annotated[float, Field(ge=0.02, le=0.5)] = 0.08
    connect_timeout_s: Annotated[float, Field(gt=0.0, le=120.0)] = 15.0
    # (x, y, z, rx, ry, rz) in m and rad that the calibration was made with; None takes whatever
    # the controller has. A different TCP on the controller then refuses to connect.
    tcp_offset: tuple[Finite, Finite, Finite, Finite, Finite, Finite] | None = None
