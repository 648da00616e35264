"""Errors by the phase in which they happen.

RigError
├── ConfigError (ValueError)            the configuration is wrong; nothing was opened
├── ConnectError (ConnectionError)      a device could not be opened or set up
├── OperateError                        a device failed while in use
│   ├── DeviceTimeoutError (TimeoutError)   it did not answer or deliver in time
│   └── MotionRefusedError              it is well but cannot make this motion
└── SafetyError                         motion was refused or stopped to stay safe

A message says what happened, to which device, and what to do next. Vendor exceptions are
converted at the driver's edge with ``raise ... from error``.
"""


class RigError(Exception):
    """Root of every error that the rig raises on purpose."""


class ConfigError(RigError, ValueError):
    """A configuration value or file is wrong; nothing was opened and nothing moved."""


class ConnectError(RigError, ConnectionError):
    """A device could not be opened, found or set up."""


class OperateError(RigError):
    """A device failed while in use."""


class DeviceTimeoutError(OperateError, TimeoutError):
    """A device did not answer or deliver within its time limit."""


class MotionRefusedError(OperateError):
    """The arm is well and at rest, but cannot make the motion that was commanded."""


class SafetyError(RigError):
    """Motion was refused or stopped because going on would not have been safe."""
