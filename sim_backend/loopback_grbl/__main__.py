"""``python -m sim_backend.loopback_grbl --link PATH``: the gantry as a process of its own."""

import argparse
import contextlib
import os
import sys
import threading
from pathlib import Path

import numpy as np

from drivers.clock import WallClock
from sim_backend.loopback_grbl.control import ControlServer, socket_path
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry

_LOOK_S = 0.05
_PRIORITY = 20


def main() -> int:
    """Serve until the lifetime is over or, if asked, until standard input closes."""
    parser = argparse.ArgumentParser(prog="sim_backend.loopback_grbl")
    parser.add_argument("--link", type=Path, required=True, help="the port's name, made a link")
    parser.add_argument("--flavour", choices=["grblHAL", "Grbl"], default="grblHAL")
    parser.add_argument("--axes", type=int, choices=[3, 4, 5, 6], default=6)
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--locked", action="store_true", help="in alarm, as after power-up")
    parser.add_argument("--lifetime-s", type=float, default=3600.0)
    parser.add_argument("--q-start", type=_numbers, help="joints in m and rad; default: zero")
    parser.add_argument("--end-with-stdin", action="store_true")
    options = parser.parse_args()
    # It stands for another machine: it should not wait for the programs on this one.
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    machine = Machine(
        flavour=options.flavour, axes=options.axes, baud=options.baud, seed=options.seed
    )
    ending = threading.Event()
    if options.end_with_stdin:
        threading.Thread(target=_end_with_stdin, args=(ending,), daemon=True).start()
    clock = WallClock()
    end_s = clock.now_s() + options.lifetime_s
    q_start = np.zeros(6) if options.q_start is None else np.array(options.q_start)
    start = machine.machine_position(q_start)
    with LoopbackGantry(machine, start, options.link, clock, options.locked) as gantry:
        control = ControlServer(gantry, socket_path(options.link))
        print("ready", flush=True)
        while clock.now_s() < end_s and not ending.wait(_LOOK_S):
            gantry.sync()
        control.close()
    return 0


def _numbers(text: str) -> tuple[float, ...]:
    values = tuple(float(part) for part in text.split(","))
    if len(values) != 6:
        raise argparse.ArgumentTypeError("six numbers separated by commas")
    return values


def _end_with_stdin(ending: threading.Event) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    ending.set()


if __name__ == "__main__":
    sys.exit(main())
