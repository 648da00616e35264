"""Samples for tests of what works on them."""

from dataclasses import replace

import numpy as np

from drivers.ur.ring import Sample

HEALTHY = Sample(
    t_s=10.0,
    arrival_s=10.0,
    controller_s=1000.0,
    T_base_tool=np.eye(4),
    twist_base=np.zeros(6),
    q_rad=np.zeros(6),
    tcp_offset=np.zeros(6),
    safety_status_bits=1,
    safety_mode=1,
    robot_mode=7,
    runtime_state=2,
    speed_scaling=1.0,
)


def sample_at(t_s: float, **changes: object) -> Sample:
    """A healthy sample that was true and arrived at ``t_s``, with changes."""
    return replace(HEALTHY, t_s=t_s, arrival_s=t_s, **changes)  # type: ignore[arg-type]
