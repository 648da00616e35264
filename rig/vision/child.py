"""The process that reads the camera and measures: the far end of ``ProcessVision``.

It ends when the parent hangs up, which the system does for a parent that dies, however it dies.
"""

import contextlib
import os
import signal
import socket
import sys
import threading

from drivers.clock import WallClock
from drivers.errors import RigError
from drivers.interfaces import Camera
from estimator.image.tracker import TargetTracker, warm_up
from rig.build import open_remote_camera
from rig.vision.images import ImageRing
from rig.vision.messages import (
    BEGIN,
    MOST_BYTES,
    Idle,
    Images,
    Job,
    Message,
    Ready,
    failed,
    job_of,
    seen,
    to_bytes,
)
from rig.vision.sighting import READ_TIMEOUT_S, Sighting, camera_problem

_RELEASE_TIMEOUT_S = 2.0  # for letting go of the camera in good order


class Child:
    """Serves one parent."""

    def __init__(self, job: Job, parent: socket.socket, feed: int | None) -> None:
        self._job = job
        self._parent = parent
        self._feed = feed
        self._begun = threading.Event()
        self._ending = threading.Event()
        self._ring: ImageRing | None = None
        threading.Thread(target=self._listen, name="parent", daemon=True).start()

    def run(self) -> int:
        """Compile, open, measure until the end; the exit status."""
        job = self._job
        camera: Camera | None = None
        try:
            warm_up(job.target, job.intrinsics, job.config.camera.method)
            camera = open_remote_camera(job.config, job.target, self._feed, WallClock())
            self._tell(Ready())
            self._begun.wait()
            self._measure(camera)
        except RigError as error:
            self._tell(failed(error))
            return 1
        finally:
            if camera is not None:
                camera.close()
        return 0

    def _measure(self, camera: Camera) -> None:
        job = self._job
        tracker = TargetTracker(job.target, job.intrinsics, job.config.camera.method)
        while not self._ending.is_set():
            frame = camera.read(READ_TIMEOUT_S)
            if frame is None:
                self._tell(Idle(camera_problem(camera)))
            else:
                self._deliver(Sighting(frame, tracker.measure(frame.image)))

    def _deliver(self, sighting: Sighting) -> None:
        image = sighting.frame.image
        ring = self._ring
        if ring is None or ring.shape != image.shape:
            ring = self._ring = self._new_ring((image.shape[0], image.shape[1]))
        self._tell(seen(sighting, ring.put(image)))

    def _new_ring(self, shape: tuple[int, int]) -> ImageRing:
        ring, file = ImageRing.create(shape)
        try:
            packet = to_bytes(Images(*shape))
            with contextlib.suppress(OSError):  # nobody listens any more
                socket.send_fds(self._parent, [packet], [file])
        finally:
            os.close(file)
        return ring

    def _tell(self, message: Message) -> None:
        # Waits while the parent does not listen: there is nobody to measure for.
        with contextlib.suppress(OSError):
            self._parent.send(to_bytes(message))

    def _listen(self) -> None:
        """Follow the parent until it hangs up, then see to it that this process ends."""
        with contextlib.suppress(OSError):
            while packet := self._parent.recv(MOST_BYTES):
                if packet == BEGIN:
                    self._begun.set()
        self._ending.set()
        self._begun.set()
        # A compiler or a camera that does not answer must not keep it alive.
        timer = threading.Timer(_RELEASE_TIMEOUT_S, os._exit, (0,))
        timer.daemon = True
        timer.start()


def main() -> None:
    """Arguments: the parent's socket, a simulated arm's motion; the job is the first packet."""
    # Ctrl-C at a terminal is the parent's to handle; it then ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A program started under a real-time policy hands it on; measuring must not compete with it.
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    parent = socket.socket(fileno=int(sys.argv[1]))
    feed = int(sys.argv[2]) if len(sys.argv) > 2 else None
    packet = parent.recv(MOST_BYTES)
    status = Child(job_of(packet), parent, feed).run() if packet else 0
    sys.stderr.flush()
    # Not through the interpreter's end, which takes a while and may wait for a camera's threads.
    os._exit(status)
