"""One log a run, ``log.mcap``: written off the control thread, readable after any end.

Written with the plain ``mcap`` package rather than ``foxglove-sdk``.
"""
