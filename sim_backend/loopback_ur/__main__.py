"""``python -m sim_backend.loopback_ur``: the controller as a process of its own."""

import argparse
import contextlib
import os
import sys
import threading

from drivers.clock import WallClock
from sim_backend.loopback_ur.config import ControllerConfig, version_of
from sim_backend.loopback_ur.kinematics import HOME_Q
from sim_backend.loopback_ur.server import LoopbackServer

_PRIORITY = 20


def main() -> int:
    """Serve until the lifetime is over or, if asked, until standard input closes."""
    parser = argparse.ArgumentParser(prog="sim_backend.loopback_ur")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--lifetime-s", type=float, default=3600.0)
    parser.add_argument("--unlock-after-s", type=float, default=5.0)
    parser.add_argument("--tcp-offset", type=_six_numbers, default=(0.0,) * 6)
    home = tuple(float(x) for x in HOME_Q)
    parser.add_argument("--q-start", type=_six_numbers, default=home)
    parser.add_argument("--seed", type=int, default=0)
    latest = ControllerConfig().version
    parser.add_argument("--version", type=version_of, default=latest, help="3.… is a CB3")
    parser.add_argument("--end-with-stdin", action="store_true")
    options = parser.parse_args()
    config = ControllerConfig(
        unlock_after_s=options.unlock_after_s,
        tcp_offset=options.tcp_offset,
        q_start=options.q_start,
        version=options.version,
    )
    # It stands for another machine: it should not wait for the programs on this one.
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    clock = WallClock()
    try:
        server = LoopbackServer(options.host, config, clock, options.seed)
    except OSError as error:
        print(error, file=sys.stderr)
        return 1
    if options.end_with_stdin:
        threading.Thread(target=_end_with_stdin, args=(server,), daemon=True).start()
    print("ready", flush=True)
    server.serve(clock.now_s() + options.lifetime_s)
    return 0


def _six_numbers(text: str) -> tuple[float, ...]:
    values = tuple(float(part) for part in text.split(","))
    if len(values) != 6:
        raise argparse.ArgumentTypeError("six numbers separated by commas")
    return values


def _end_with_stdin(server: LoopbackServer) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    server.stop()


if __name__ == "__main__":
    sys.exit(main())
