"""Turns the state stream into stamped samples, in a thread of the child process."""

import math
import threading
from collections.abc import Callable
from typing import cast

import numpy as np

from drivers.ur.geometry import pose_matrix
from drivers.ur.ring import Sample, SampleRing
from drivers.ur.rtde_codec import RtdeError, Value
from drivers.ur.rtde_stream import RtdeStream
from drivers.ur.time_map import TimeMap

_POLL_S = 0.05
_UNKNOWN_TCP = (math.nan,) * 6


class Sampler:
    """Makes samples of packets; one per connection, because it learns the controller's clock."""

    def __init__(self) -> None:
        self._time_map = TimeMap()
        self._last_controller_s = -math.inf
        self._last_s = -math.inf

    def samples(self, packets: list[dict[str, Value]], arrival_s: float) -> list[Sample]:
        """The packets that arrived together as samples, their instants strictly increasing.

        Left out are repeated packets, and those that cannot be told from the samples before:
        what was learned since showed that those were stamped too late.
        """
        fresh = []
        for fields in packets:
            controller_s = cast(float, fields["timestamp"])
            if controller_s != self._last_controller_s:
                self._time_map.learn(controller_s, arrival_s)
                fresh.append((controller_s, fields))
            self._last_controller_s = controller_s
        # Only now: the last of a burst was delayed least, and tells when the first were true.
        stamped = [(min(self._time_map.at(c), arrival_s), c, fields) for c, fields in fresh]
        samples = []
        for t_s, controller_s, fields in stamped:
            if t_s > self._last_s:
                self._last_s = t_s
                samples.append(_sample(fields, t_s, controller_s, arrival_s))
        return samples


def _sample(fields: dict[str, Value], t_s: float, controller_s: float, arrival_s: float) -> Sample:
    return Sample(
        t_s=t_s,
        arrival_s=arrival_s,
        controller_s=controller_s,
        T_base_tool=pose_matrix(np.array(fields["actual_TCP_pose"])),
        twist_base=np.array(fields["actual_TCP_speed"]),
        q_rad=np.array(fields["actual_q"]),
        tcp_offset=np.array(fields.get("tcp_offset", _UNKNOWN_TCP)),
        safety_status_bits=cast(int, fields["safety_status_bits"]),
        safety_mode=cast(int, fields["safety_mode"]),
        robot_mode=cast(int, fields["robot_mode"]),
        runtime_state=cast(int, fields["runtime_state"]),
        speed_scaling=cast(float, fields["speed_scaling"]),
    )


class Receiver:
    """The thread: packets in, samples onto the ring, until the stream ends or ``stop``."""

    def __init__(
        self, stream: RtdeStream, ring: SampleRing, on_lost: Callable[[str], None]
    ) -> None:
        self._stream = stream
        self._ring = ring
        self._on_lost = on_lost
        self._stopping = False
        self._sampler = Sampler()
        self._thread = threading.Thread(target=self._run, name="arm-states", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread and close the stream."""
        self._stopping = True
        self._thread.join(1.0)
        self._stream.close()

    def _run(self) -> None:
        try:
            while not self._stopping:
                packets, arrival_s = self._stream.read(_POLL_S)
                for sample in self._sampler.samples(packets, arrival_s):
                    self._ring.publish(sample)
        except (OSError, RtdeError) as error:
            self._on_lost(str(error))
