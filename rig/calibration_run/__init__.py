"""A calibration as it happens on a rig: moving to poses, taking pictures, keeping them.

Belongs here: everything between the devices and ``rig.calibration``. Does not belong here: the
mathematics of a fit, and anything that knows which devices these are.
"""
