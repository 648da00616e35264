"""Who does the runs: processes of this machine. A cluster's workers are in ``cluster``."""

import multiprocessing
import signal
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import Protocol, Self

from drivers.errors import OperateError
from rig.campaign.job import Job
from rig.campaign.worker import Row, run_case


class Workers(Protocol):
    """Takes jobs and gives rows; leaving its ``with`` block drops what is not done."""

    def at_once(self) -> int:
        """How many runs can go on at the same time, just now."""
        ...

    def submit(self, job: Job) -> "Future[Row]":
        """Hand out a job; raises OperateError when nobody is left to take it."""
        ...

    def row(self, done: "Future[Row]") -> Row:
        """What a finished job came to; raises OperateError when whoever had it died of it."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


class LocalWorkers:
    """``processes`` of this machine."""

    def __init__(self, processes: int) -> None:
        self._processes = processes
        # Not forked: compiled code and threads do not survive that.
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(processes, context, _ignore_interrupts)

    def at_once(self) -> int:
        """The number of processes."""
        return self._processes

    def submit(self, job: Job) -> "Future[Row]":
        """Queue a job."""
        try:
            return self._pool.submit(run_case, job)
        except BrokenProcessPool as error:
            raise _died() from error

    def row(self, done: "Future[Row]") -> Row:
        """Its row."""
        try:
            return done.result()
        except BrokenProcessPool as error:
            raise _died() from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)


def _ignore_interrupts() -> None:
    """Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _died() -> OperateError:
    return OperateError(
        "a process of the campaign died (out of memory?): what is finished is kept; "
        "begin again with the same --out, or with fewer --jobs"
    )
