"""The names and types that RTDE offers; source: Universal Robots' RTDE guide."""

from drivers.ur.rtde_codec import Value

_SIX_DOUBLES = (
    "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current "
    "joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose "
    "target_TCP_speed joint_temperatures actual_joint_voltage ft_raw_wrench payload_inertia "
    "tcp_offset actual_current_window"
)
_DOUBLES = (
    "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum "
    "actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 "
    "standard_analog_input1 standard_analog_output0 standard_analog_output1 io_current "
    "tool_analog_input0 tool_analog_input1 tool_output_current tool_temperature "
    "tcp_force_scalar payload"
)
_THREE_DOUBLES = "actual_tool_accelerometer payload_cog elbow_position"
_LONG_BITS = "actual_digital_input_bits actual_digital_output_bits"
_BITS = (
    "runtime_state robot_status_bits safety_status_bits analog_io_types "
    "output_bit_registers0_to_31 output_bit_registers32_to_63"
)
_INTEGERS = "robot_mode safety_mode safety_status tool_output_voltage"

OUTPUTS: dict[str, str] = {
    **dict.fromkeys(_DOUBLES.split(), "DOUBLE"),
    **dict.fromkeys(_SIX_DOUBLES.split(), "VECTOR6D"),
    **dict.fromkeys(_THREE_DOUBLES.split(), "VECTOR3D"),
    **dict.fromkeys(_LONG_BITS.split(), "UINT64"),
    **dict.fromkeys(_BITS.split(), "UINT32"),
    **dict.fromkeys(_INTEGERS.split(), "INT32"),
    "joint_mode": "VECTOR6INT32",
    **{f"output_int_register_{i}": "INT32" for i in range(48)},
    **{f"output_double_register_{i}": "DOUBLE" for i in range(48)},
}

# Outputs that came with a version: of CB3 controllers, of e-Series controllers (None: never).
# Sources: the guide; for ``tcp_offset``, which it does not list, the notes of Universal Robots'
# own client library. What else is older or newer is not told apart.
_SINCE: dict[str, tuple[tuple[int, ...] | None, tuple[int, ...]]] = {
    "tcp_offset": ((3, 12), (5, 5, 1)),
    "safety_status": ((3, 10), (5, 4)),
    "payload": ((3, 11), (5, 5, 1)),
    "payload_cog": ((3, 11), (5, 5, 1)),
    "payload_inertia": ((3, 15), (5, 11)),
    "ft_raw_wrench": (None, (5, 9)),
}
_CB3 = 3


def outputs_of(version: tuple[int, ...]) -> dict[str, str]:
    """Names and types of the outputs that a controller of ``version`` knows."""
    known = dict(OUTPUTS)
    for name, (cb3, e_series) in _SINCE.items():
        since = cb3 if version[0] <= _CB3 else e_series
        if since is None or version < since:
            del known[name]
    return known


INPUTS: dict[str, str] = {
    "speed_slider_mask": "UINT32",
    "speed_slider_fraction": "DOUBLE",
    "standard_digital_output_mask": "UINT8",
    "standard_digital_output": "UINT8",
    "configurable_digital_output_mask": "UINT8",
    "configurable_digital_output": "UINT8",
    "tool_digital_output_mask": "UINT8",
    "tool_digital_output": "UINT8",
    "standard_analog_output_mask": "UINT8",
    "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE",
    "standard_analog_output_1": "DOUBLE",
    "input_bit_registers0_to_31": "UINT32",
    "input_bit_registers32_to_63": "UINT32",
    "external_force_torque": "VECTOR6D",
    **{f"input_bit_register_{i}": "BOOL" for i in range(64, 128)},
    **{f"input_int_register_{i}": "INT32" for i in range(48)},
    **{f"input_double_register_{i}": "DOUBLE" for i in range(48)},
}

_ZERO_OF: dict[str, Value] = {
    "VECTOR3D": (0.0,) * 3,
    "VECTOR6D": (0.0,) * 6,
    "VECTOR6INT32": (0,) * 6,
}


def zero_of(kind: str) -> Value:
    """The zero of a type."""
    return _ZERO_OF.get(kind, 0)
