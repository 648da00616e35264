"""What the firmware prints: status reports, the settings list, build information."""

from sim_backend.loopback_grbl.machine import FloatArray, Machine

_WCO_EVERY, _OV_EVERY = 30, 20  # reports; both appear in the first ones


def status_report(
    state: str,
    position: FloatArray,
    blocks_free: int,
    rx_free: int,
    feed: float,
    pins: str,
    count: int,
) -> str:
    """The answer to ``?``: state, machine position, free buffers, prepared speed, pins."""
    fields = [
        state,
        "MPos:" + _numbers(position),
        f"Bf:{blocks_free},{rx_free}",
        f"FS:{feed:.0f},0",
    ]
    if pins:
        fields.append("Pn:" + pins)
    if count % _WCO_EVERY == 0:
        fields.append("WCO:" + _numbers(0.0 * position))
    elif count % _OV_EVERY == 1:
        fields.append("Ov:100,100,100")
    return "<" + "|".join(fields) + ">"


def settings_list(machine: Machine) -> list[str]:
    """The lines of ``$$`` that matter to a host."""
    lines = ["$10=511" if machine.flavour == "grblHAL" else "$10=3", "$11=0.010", "$13=0"]
    lines += [f"$20={int(machine.soft_limits)}", f"$22={int(machine.homing)}"]
    lines += [f"${100 + i}={machine.steps_per_unit[i]:.3f}" for i in range(machine.axes)]
    lines += [f"${110 + i}={machine.max_rate[i]:.3f}" for i in range(machine.axes)]
    lines += [f"${120 + i}={machine.acceleration[i]:.3f}" for i in range(machine.axes)]
    lines += [f"${130 + i}={machine.high[i] - machine.low[i]:.3f}" for i in range(machine.axes)]
    if machine.flavour == "grblHAL":
        lines.append(f"$701={machine.rotary_in_norm}")
    return lines


def build_info(machine: Machine) -> list[str]:
    """The lines of ``$I``; plain Grbl names no axes."""
    if machine.flavour == "Grbl":
        return ["[VER:1.1h.20190825:]", f"[OPT:V,{machine.planner_blocks},{machine.rx_bytes}]"]
    return [
        "[VER:1.1f.20240101:]",
        f"[OPT:VNML+,{machine.planner_blocks},{machine.rx_bytes},{machine.axes},0]",
        f"[AXS:{machine.axes}:{machine.letters}]",
        "[FIRMWARE:grblHAL]",
    ]


def _numbers(values: FloatArray) -> str:
    return ",".join(f"{round(value, 3) + 0.0:.3f}" for value in values)
