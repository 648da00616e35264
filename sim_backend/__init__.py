"""The simulated rig: a MuJoCo world behind the interfaces of ``drivers``.

Belongs here: the world's model, its renderers, the simulated camera and arm, the simulated
clock, and the ground truth that tests and reports may ask for. Does not belong here: the
estimator or anything that helps it. Imports ``drivers`` only.
"""
