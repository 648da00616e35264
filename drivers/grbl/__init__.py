"""A serial gantry under grblHAL or plain Grbl, driven by velocity through streamed jogs.

``arm.GrblArm`` is the device: a thread and a serial port around ``core.Core``, which is pure
(bytes and instants in, bytes and states out) and therefore tested on simulated time.
"""
