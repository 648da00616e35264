"""The hardware: interfaces.py (the whole HAL on one page), one module per device, errors, clock.

Belongs here: what talks to a camera or an arm and turns it into stamped frames and states.
Does not belong here: image processing, estimation, control, configuration files, and any
choice between simulated and real. Imports none of the other three packages.
"""
