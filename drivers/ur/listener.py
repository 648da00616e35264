"""A Universal Robots arm that is only listened to: nothing is uploaded, nothing can move it.

For an arm that a person leads by hand (freedrive) or moves with its pendant, in local mode too.
"""

from drivers.clock import Clock
from drivers.errors import ConnectError, MotionRefusedError, OperateError
from drivers.interfaces import ArmState, FloatArray
from drivers.ur.geometry import to_tool_axes
from drivers.ur.receiver import Sampler
from drivers.ur.rtde_codec import RtdeError
from drivers.ur.rtde_stream import RtdeStream
from drivers.ur.settings import UrSettings


class UrListener:
    """The arm's states through the ``Arm`` interface; raises ConnectError when it is not there.

    States come only while somebody reads them.
    """

    def __init__(self, settings: UrSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._stream = RtdeStream(settings.host, clock, settings.connect_timeout_s)
        self._sampler = Sampler()

    def read_states(self) -> list[ArmState]:
        """Every sample since the last call, oldest first; raises OperateError when it is lost."""
        states: list[ArmState] = []
        try:
            while True:
                packets, arrival_s = self._stream.read(0.0)
                states += [
                    ArmState(
                        t_s=one.t_s,
                        T_base_tool=one.T_base_tool,
                        twist_tool=to_tool_axes(one.T_base_tool[:3, :3], one.twist_base),
                    )
                    for one in self._sampler.samples(packets, arrival_s)
                ]
                if not packets:
                    return states
        except (OSError, RtdeError, ConnectError) as error:
            raise OperateError(
                f"the connection to the arm at {self._settings.host} is lost ({error}): check the "
                "cable and the controller"
            ) from error

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Refuse."""
        raise MotionRefusedError(
            f"the arm at {self._settings.host} is only listened to: move it by hand or pendant"
        )

    def stop(self) -> None:
        """Nothing: whoever moves it stops it."""

    def close(self) -> None:
        """Hang up."""
        self._stream.close()
