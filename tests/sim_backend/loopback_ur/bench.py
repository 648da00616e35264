"""The emulated controller on a bench, cycle by cycle."""

import numpy as np

from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.motion import STEP_S

SCRIPT = "def x():\n  read_input_integer_reg(0)\nend\n"


class Bench:
    """A controller that runs the control program, with a hand on its registers."""

    def __init__(self, **config):
        self.controller = Controller(ControllerConfig(**config))
        self.controller.start_program(SCRIPT)

    def command(self, code, *doubles, integer=0):
        values = {f"input_double_register_{i}": x for i, x in enumerate(doubles)}
        values |= {"input_int_register_1": integer, "input_int_register_0": code}
        self.controller.write_inputs(values)

    def run(self, seconds, feed=True):
        """Run; with ``feed`` the last command is repeated each cycle."""
        for _ in range(round(seconds / STEP_S)):
            if feed:
                last = self.controller.inputs["input_int_register_0"]
                self.controller.write_inputs({"input_int_register_0": last})
            self.controller.step()

    @property
    def state(self):
        return self.controller.outputs()["output_int_register_0"]

    @property
    def speed(self):
        return float(np.abs(self.controller.motion.twist_base()).max())
