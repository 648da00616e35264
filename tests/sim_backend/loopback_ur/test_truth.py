"""A camera on the emulated arm sees the true motion, in the controller's process or another."""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.clock import WallClock
from sim_backend.clock import SimulatedClock
from sim_backend.history import JointHistory
from sim_backend.loopback_rig.remote import RemoteMotion
from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.control_port import ControlPort
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.faults import Faults
from sim_backend.loopback_ur.kinematics import HOME_Q, tool_pose, transform
from sim_backend.loopback_ur.motion import STEP_S
from sim_backend.loopback_ur.process import LoopbackControl, LoopbackProcess
from sim_backend.loopback_ur.truth import ArmCameraMotion, ArmTruth
from tests.drivers.ur.loopback import start_loopback

pytestmark = pytest.mark.realtime

T_TOOL_CAMERA = transform((0.03, -0.02, 0.06, 0.1, -0.08, 0.12))
CLOCK = WallClock()


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback(q_start=tuple(HOME_Q + 0.1)) as process:
        yield process


def recorded(seconds):
    controller = Controller(ControllerConfig())
    motion = controller.motion
    history = JointHistory(5.0, STEP_S)
    history.append(motion.q, motion.qd)
    motion.speed_tool(np.array([0.05, 0.02, 0.0, 0.1, 0.0, 0.3]), 2.0)
    for _ in range(round(seconds / STEP_S)):
        controller.step()
        history.append(motion.q, motion.qd)
    return ArmTruth(history, np.eye(4), SimulatedClock(5.0 + seconds))


def test_the_cameras_twist_is_the_derivative_of_its_pose():
    motion = ArmCameraMotion(recorded(1.0), T_TOOL_CAMERA)
    h = 1e-3
    for t_s in (5.3, 5.7003, 5.9):
        T, before, after = (motion.T_base_camera(t_s + dt) for dt in (0.0, -h, h))
        v = T[:3, :3].T @ (after[:3, 3] - before[:3, 3]) / (2 * h)
        w = Rotation.from_matrix(before[:3, :3].T @ after[:3, :3]).as_rotvec() / (2 * h)
        assert np.allclose(motion.twist_camera(t_s), [*v, *w], atol=1e-4)


def test_nothing_is_known_outside_the_record():
    truth = recorded(0.1)
    assert truth.sync() == pytest.approx(5.1)
    with pytest.raises(ValueError, match="outside the recorded motion"):
        truth.T_base_tool(5.2)


def test_another_process_sees_the_same_and_stays_up_to_date(loopback):
    control = LoopbackControl(loopback.host)
    motion = RemoteMotion(control, lambda q: tool_pose(q, np.eye(4)), T_TOOL_CAMERA, CLOCK)
    first_s = motion.sync()
    CLOCK.sleep_until(first_s + 0.1)
    newest_s = motion.sync()
    assert first_s < newest_s <= CLOCK.now_s()
    expected = tool_pose(HOME_Q + 0.1, np.eye(4)) @ T_TOOL_CAMERA
    assert np.allclose(motion.T_base_camera(newest_s), expected)
    control.close()


def test_who_asks_between_two_samples_does_not_get_the_former_again():
    truth = recorded(0.1)
    controller = Controller(ControllerConfig())
    port = ControlPort(controller, Faults(controller), truth)

    def since(t_s):
        rows = json.loads(port.answer(json.dumps({"get": "motion", "since_s": t_s})))["motion"]
        return [row[0] for row in rows]

    samples = [5.0 + k * STEP_S for k in range(51)]
    assert since(0.0) == pytest.approx(samples)
    assert since(5.0 + 10 * STEP_S) == pytest.approx(samples[10:])
    assert since(5.0 + 10.5 * STEP_S) == pytest.approx(samples[11:])
    assert since(5.0 + 50.5 * STEP_S) == []
