"""The simulated gantry for ``rig arm``, on the wall clock: to try the commands without hardware."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.interfaces import Arm
from rig.arm_kits import Address, Json
from sim_backend.config import SimConfig
from sim_backend.rig import SimulatedRig


class SimKit:
    """The simulated rig's arm; it has no address and no faults."""

    max_state_age_s = 0.1

    def __init__(self, address: Address) -> None:
        pass

    def open(self, clock: Clock) -> Arm:
        """The gantry at the start pose of the sphere."""
        return SimulatedRig(SimConfig(), "sphere", clock).arm

    def status(self, clock: Clock) -> dict[str, Json]:
        """Where a freshly started simulation has its arm."""
        arm = self.open(clock)
        clock.sleep_until(clock.now_s() + 0.05)
        state = arm.read_states()[-1]
        arm.close()
        return {
            "controller": "simulated gantry",
            "tool_position_m": state.T_base_tool[:3, 3].tolist(),
            "problem": None,
        }

    def stop(self, clock: Clock) -> str:
        """Nothing: a simulated arm lives only as long as the command that made it."""
        return "the simulated arm stands still"

    def recover(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Nothing to recover from."""
        return "the simulated arm is always ready"

    def home(self, clock: Clock, confirm: Callable[[str], bool]) -> str:
        """Nothing to find."""
        return "the simulated arm always knows where it is"
