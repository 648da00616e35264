"""A UR5e controller on loopback: RTDE, script port and dashboard, for tests and demonstrations.

``motion``, ``program``, ``controller``, ``rtde_session``, ``script_port`` and ``dashboard`` are
pure: bytes and steps in, bytes and state out. ``server`` puts them on sockets in real time.
What is assumed about a real controller, and not documented, is said where it is assumed.
"""
