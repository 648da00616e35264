"""The application: what happens when.

Belongs here: the command line, configuration, scheduler, control loop, safety, records and
reports. Does not belong here: mathematics (``estimator``) and device protocols (``drivers``).
``rig.build`` is the only module that chooses between simulated and real devices.
"""
