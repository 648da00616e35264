"""After the rehearsal a tick finds everything compiled, for each kind of target and motion."""

import subprocess
import sys
from pathlib import Path

import pytest

from rig.config import TargetKind
from rig.config_load import load_config
from rig.motion import make_controller
from rig.rehearsal import rehearse
from rig.run import make_observer

# In a process of its own: in this one other tests have compiled what they needed.
PROGRAM = """
import gc, sys
from pathlib import Path
from numba.core.dispatcher import Dispatcher
from rig.rehearsal import rehearse
from rig.motion import make_controller
from rig.run import make_observer
from tests.rig.fakes import make_bench

def compiled():
    kernels = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {(one.py_func.__qualname__, str(sign)) for one in kernels for sign in one.signatures}

bench = make_bench(Path(sys.argv[1]), ["motion.policy=" + sys.argv[2], "run.duration_s=1"])
config = bench.config
rehearse(make_observer(config, "sphere"), make_controller(config), "sphere")
before = compiled()
bench.loop.run()
print(len(before), sorted(compiled() - before))
"""


@pytest.mark.parametrize("policy", ["constant", "paper", "servo"])
@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_every_target_and_policy_can_be_rehearsed(target: TargetKind, policy: str) -> None:
    config = load_config(target, None, [f"motion.policy={policy}"])
    observer = make_observer(config, target)
    rehearse(observer, make_controller(config), target)
    assert observer.estimate is not None  # images were used, not refused


@pytest.mark.parametrize("policy", ["constant", "paper", "servo"])
def test_a_run_compiles_nothing_after_it(tmp_path: Path, policy: str) -> None:
    command = [sys.executable, "-c", PROGRAM, str(tmp_path), policy]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    count, _, more = said.partition(" ")
    assert int(count) >= 3
    assert more.strip() == "[]"
