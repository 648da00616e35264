"""A gantry controller that speaks the serial protocol of grblHAL or plain Grbl, on a pty.

``Firmware`` is a pure machine driven by a clock: bytes in, bytes out, ``advance_to(t)``; the
modules below it are its wire, its G-code, its planner and its motion. ``LoopbackGantry`` puts
it on a pty in real time. What is modelled is the behaviour measured on the firmware itself,
built for the PC; where a module assumes instead, it says so.
"""
