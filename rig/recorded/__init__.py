"""A past run, read back from its directory: the one place that knows how it was recorded.

``read_run`` (read.py) is all that reports and the page need, ``read_setup`` (setup.py) all that a
list needs; the log's format is behind them.
"""
