"""A camera on the network for tests, CI and demos: frames from a callable as an MJPEG stream.

What is assumed: the headers X-Timestamp (CLOCK_MONOTONIC at mid-exposure), X-Sequence and
X-Exposure are this project's own. The multipart layout is what common camera servers send.
"""
