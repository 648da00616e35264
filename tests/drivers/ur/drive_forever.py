"""A program that moves the arm until it is killed; prints the id of its child when it moves."""

import sys

import numpy as np

from drivers.clock import WallClock
from drivers.ur.arm import UrArm
from drivers.ur.settings import UrSettings


def main() -> None:
    clock = WallClock()
    arm = UrArm(UrSettings(host=sys.argv[1], watchdog_hz=float(sys.argv[2])), clock)
    twist = np.array([0.04, 0.0, 0.02, 0.0, 0.0, 0.0])
    started_s = clock.now_s()
    announced = False
    while clock.now_s() < started_s + 30.0:
        # A hold time longer than the test: only the death of the program may stop the arm.
        arm.command_twist(twist, 25.0)
        states = arm.read_states()
        if not announced and states and np.linalg.norm(states[-1].twist_tool[:3]) > 0.04:
            print(arm.child_pid, flush=True)
            announced = True
        clock.sleep_until(clock.now_s() + 0.01)


if __name__ == "__main__":
    main()
