"""A scheduler and workers of this machine, each a process of its own that can be killed."""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

HOST = "127.0.0.1"
_QUIET = ("--no-dashboard",)
_STARTS_S = 100.0
_LEAVES_S = 10.0


@dataclass
class LocalCluster:
    """Its address, and its processes in the order of their start."""

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def add_worker(self) -> None:
        """Start one that runs one job at a time, and that nothing starts anew when it dies."""
        options = ("--no-nanny", "--nthreads", "1", "--host", HOST, *_QUIET)
        # It ends by itself when its scheduler is gone for so long.
        options = (*options, "--death-timeout", "20")
        self.workers.append(_dask("worker", self.address, *options))


@contextmanager
def local_cluster(workers: int) -> Iterator[LocalCluster]:
    """A cluster for the duration of a ``with`` block."""
    with socket.socket() as free:
        free.bind((HOST, 0))
        port = free.getsockname()[1]
    scheduler = _dask("scheduler", "--host", HOST, "--port", str(port), *_QUIET)
    cluster = LocalCluster(f"tcp://{HOST}:{port}", scheduler)
    try:
        _wait_for(port)
        for _ in range(workers):
            cluster.add_worker()
        yield cluster
    finally:
        for process in (*cluster.workers, scheduler):
            process.kill()
            process.wait(_LEAVES_S)


def _wait_for(port: int) -> None:
    """Until the scheduler listens: on a busy machine its start takes long."""
    deadline_s = time.monotonic() + _STARTS_S
    while True:
        try:
            socket.create_connection((HOST, port), timeout=1.0).close()
        except OSError:
            if time.monotonic() > deadline_s:
                raise
            time.sleep(0.05)
        else:
            return


def _dask(command: str, *arguments: str) -> subprocess.Popen[bytes]:
    code = "from dask.__main__ import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", code, command, *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
