"""A UR5e controller on loopback: RTDE, script port and dashboard, for tests and demonstrations.

``arm_model`` is the arm in MuJoCo, ``motion`` the references it follows; both step by 2 ms.
``program``, ``controller``, ``rtde_session``, ``script_port`` and ``dashboard`` take bytes and
steps and give bytes and state, without a clock or sockets. ``server`` puts them on sockets in real
time. What is assumed about a real controller, and not documented, is said where it is assumed.
"""
