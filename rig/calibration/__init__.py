"""What a calibration computes: arrays in, results out; no device is known here.

Belongs here: the board, the detection of its corners, the fits of intrinsics, hand-eye and
latency, the choice of poses, the verification and the calibration file. Does not belong here:
moving an arm or reading a camera.
"""
