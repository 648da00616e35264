"""A Universal Robots arm that is only listened to: nothing is uploaded, nothing can move it.

For an arm that a person leads by hand (freedrive) or moves with its pendant, in local mode too.
"""

import numpy as np

from drivers.clock import Clock
from drivers.errors import ConnectError, MotionRefusedError, OperateError
from drivers.interfaces import ArmState, FloatArray
from drivers.ur.geometry import to_tool_axes
from drivers.ur.receiver import Sampler
from drivers.ur.ring import Sample
from drivers.ur.rtde_codec import RtdeError
from drivers.ur.rtde_stream import RtdeStream
from drivers.ur.settings import UrSettings

_FIRST_SAMPLE_S = 1.0


class UrListener:
    """The arm's states through the ``Arm`` interface; raises ConnectError when it is not there.

    States come only while somebody reads them.
    """

    def __init__(self, settings: UrSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._stream = RtdeStream(settings.host, clock, settings.connect_timeout_s)
        self._sampler = Sampler()
        self._tcp_offset: FloatArray | None = None

    def read_states(self) -> list[ArmState]:
        """Every sample since the last call, oldest first; raises OperateError when it is lost."""
        states: list[ArmState] = []
        while samples := self._receive(0.0):
            states += [
                ArmState(
                    t_s=one.t_s,
                    T_base_tool=one.T_base_tool,
                    twist_tool=to_tool_axes(one.T_base_tool[:3, :3], one.twist_base),
                )
                for one in samples
            ]
        return states

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Refuse."""
        raise MotionRefusedError(
            f"the arm at {self._settings.host} is only listened to: move it by hand or pendant"
        )

    def tcp_offset(self) -> FloatArray | None:
        """The TCP set on the controller (6,) at the newest sample; None: it does not tell."""
        deadline_s = self._clock.now_s() + _FIRST_SAMPLE_S
        while self._tcp_offset is None and self._clock.now_s() < deadline_s:
            self._receive(0.1)
        known = self._tcp_offset
        return None if known is None or not np.all(np.isfinite(known)) else known.copy()

    def stop(self) -> None:
        """Nothing: whoever moves it stops it."""

    def close(self) -> None:
        """Hang up."""
        self._stream.close()

    def _receive(self, timeout_s: float) -> list[Sample]:
        """What arrived within ``timeout_s``; raises OperateError when the connection is lost."""
        try:
            packets, arrival_s = self._stream.read(timeout_s)
            found = self._sampler.samples(packets, arrival_s)
        except (OSError, RtdeError, ConnectError) as error:
            raise OperateError(
                f"the connection to the arm at {self._settings.host} is lost ({error}): check the "
                "cable and the controller"
            ) from error
        if found:
            self._tcp_offset = found[-1].tcp_offset
        return found
