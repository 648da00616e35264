"""One module per ``rig`` command: its arguments, what it prints, its exit status.

Heavy imports (numba, scipy, mujoco, matplotlib) wait inside the functions, so that
``rig --help`` and a mistyped option answer at once.
"""
