"""The simulated rig as its drawings have it: what is known of it without a calibration.

Like the drawings of a real rig they are a little off (7 mm, 2°, 2 % of the focal length), so
that a run on them is visibly wrong and a calibration has something to find. They say nothing
of the lens' distortion or of a truth that was set otherwise.
"""

from sim_backend.config_section import Pose

T_TOOL_CAMERA: Pose = (0.034, -0.023, 0.055, 0.12, -0.10, 0.10)
FOCAL_PX = 784.0
