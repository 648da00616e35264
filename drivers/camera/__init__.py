"""Cameras: V4L2 devices, MJPEG and RTSP streams, video files and image folders.

``open_camera`` (open.py) is the way in. A live source is a ``VideoDevice`` (device.py) that one
thread empties all the time: ``Grabber`` stamps, checks and counts what it delivers and opens it
again after a failure, ``NewestFrame`` keeps the newest frame for the reader. A recorded source
is replayed on the clock given, without a thread.
"""
