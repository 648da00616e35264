"""Universal Robots arms over RTDE: states from the controller's own stream, motion by ``ur_rtde``.

``arm.py`` is the ``Arm``; everything that touches the network runs in the child process of
``child.py``, because the vendor's control interface can crash the process that holds it.
"""
