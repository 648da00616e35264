"""One log a run, ``log.mcap``: written off the control thread, readable after any end.

Written with the plain ``mcap`` package, not ``foxglove-sdk``. Measured with Python 3.11 and JSON
messages of 440 bytes, processor time a message: mcap 1.6 9.4 µs, all in the thread that writes;
foxglove-sdk 0.30 6.6 µs, 2.1 µs of it in that thread. At 900 messages a second the difference is
3 ms a second, and none of it is the control loop's, which only hands objects over. Against that,
foxglove-sdk

- writes one instant a message: its publish time is the log time, while every message here carries
  both when it was true and when it was logged;
- cannot read, so that mcap would be needed all the same, and is 54 MB of compiled code; mcap is
  pure Python, and its compressors, lz4 and zstandard, have wheels for Python 3.11 to 3.13.

After ``kill -9`` both leave what was flushed, both flush on demand, and both raise when a write
fails. Foxglove's schemas come from ``foxglove-schemas-protobuf``, which Foxglove generates.
"""
