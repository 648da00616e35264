"""One log a run, ``log.mcap``: written off the control thread, readable after any end.

Written with the plain ``mcap`` package, not ``foxglove-sdk``. Measured (Python 3.11, JSON messages of
440 bytes, zstd, processor time a message): mcap 1.6 9.4 µs, all in the thread that writes;
foxglove-sdk 0.30 6.6 µs, 2.1 µs of it in that thread. The difference is 4 ms a second of a run, and
none of it is the control loop's, which only hands objects over. Against it stands that foxglove-sdk

- writes one instant a message: its publish time is the log time, and every message here carries both
  when it was true and when it was logged;
- is 54 MB of compiled code for x86-64 and arm64, where mcap is pure Python (its compressors, lz4 and
  zstandard, have wheels for Python 3.11 to 3.13 on both), and cannot read, so that mcap would be
  needed all the same.

After ``kill -9`` both leave what was flushed and both flush on demand; a write that fails raises in
both. Foxglove's schemas come from ``foxglove-schemas-protobuf``, which Foxglove generates.
"""
