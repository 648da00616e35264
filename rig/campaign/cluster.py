"""The runs done by the workers of a Dask cluster.

A run whose worker died is given to another one by the scheduler. What a client that leaves has
handed out is forgotten by the cluster.
"""

import logging
import re
from concurrent.futures import CancelledError, Future
from importlib import import_module
from types import TracebackType
from typing import Any, Self

from drivers.clock import Clock, WallClock
from drivers.errors import ConfigError, ConnectError, OperateError
from rig.campaign.job import Job
from rig.campaign.sources import sources_here
from rig.campaign.worker import OtherSourcesError, Row, run_case

_ADDRESS = re.compile(r"(tcp|tls)://[^\s/:]+:\d{1,5}|(tcp|tls)://\[[0-9a-fA-F:]+\]:\d{1,5}")
_CONNECT_S = 10.0
_FIRST_WORKER_S = 30.0
_NO_WORKER_S = 120.0
_COUNT_EVERY_S = 2.0
_KEPT = "what is finished is kept; begin again with the same --out"


class ClusterWorkers:
    """The workers that the scheduler at ``address`` has, whenever they come and go.

    Raises ConfigError for what is no address and where the package is missing, ConnectError
    where no scheduler answers or no worker comes, OperateError for a worker with other sources.
    """

    def __init__(self, address: str, clock: Clock | None = None) -> None:
        check_address(address)
        distributed = _distributed()
        self._address = address
        self._clock: Clock = WallClock() if clock is None else clock
        try:
            self._client: Any = distributed.Client(
                address, timeout=_CONNECT_S, set_as_default=False, name="rig-compare"
            )
        except (OSError, ValueError) as error:
            raise ConnectError(
                f"no Dask scheduler answers at {address}: start one there with "
                "`dask scheduler`, and workers with `dask worker " + address + " --nthreads 1`"
            ) from error
        try:
            self._check_workers()
        except BaseException:
            self._client.close()
            raise
        self._executor: Any = self._client.get_executor(pure=False)
        self._count = 0
        self._counted_s = self._seen_s = self._clock.now_s()

    def at_once(self) -> int:
        """The threads of all workers, as counted not long ago; raises OperateError without any."""
        now_s = self._clock.now_s()
        if self._count == 0 or now_s - self._counted_s > _COUNT_EVERY_S:
            self._count, self._counted_s = self._threads(), now_s
        if self._count:
            self._seen_s = now_s
        elif now_s - self._seen_s > _NO_WORKER_S:
            raise OperateError(f"the cluster at {self._address} has no workers left: {_KEPT}")
        return self._count

    def submit(self, job: Job) -> "Future[Row]":
        """Queue a job."""
        try:
            future: Future[Row] = self._executor.submit(run_case, job)
        except Exception as error:
            raise self._gone() from error
        return future

    def row(self, done: "Future[Row]") -> Row:
        """Its row."""
        try:
            return done.result()
        except CancelledError as error:  # nobody else cancels one
            raise self._gone() from error
        except (ImportError, OtherSourcesError) as error:
            raise OperateError(f"a worker has another activerig: {error}; {_KEPT}") from error
        except Exception as error:
            if type(error).__name__ != "KilledWorker":
                raise
            raise OperateError(
                f"one run ended several workers, one after the other (out of memory?): {_KEPT}"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leaving cancels what is handed out: nobody else has asked for it."""
        self._client.close(timeout=_CONNECT_S)

    def _check_workers(self) -> None:
        """Wait for the first worker, then compare what the workers have installed."""
        try:
            self._client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
        except TimeoutError as error:
            raise ConnectError(
                f"the scheduler at {self._address} has no workers: start some with "
                f"`dask worker {self._address} --nthreads 1`"
            ) from error
        here = sources_here()
        found = self._client.run(_probe(), on_error="return")
        wrong = [
            f"{worker} has {_name(what)}" for worker, what in sorted(found.items()) if what != here
        ]
        if wrong:
            raise OperateError(
                f"workers need the sources of this machine, {here}: {'; '.join(wrong)}. "
                "Install the same activerig in the environment they run in, and start them anew"
            )

    def _threads(self) -> int:
        try:
            return sum(self._client.nthreads().values())
        except Exception as error:
            raise self._gone() from error

    def _gone(self) -> OperateError:
        return OperateError(f"the scheduler at {self._address} is gone: {_KEPT}")


def check_address(address: str) -> None:
    """Raise ConfigError for what is no scheduler's address."""
    if not _ADDRESS.fullmatch(address):
        raise ConfigError(f"--scheduler {address!r}: write it as tcp://HOST:PORT")


def _probe() -> Any:
    """A function that workers without this program can take as well: sent as code, not by name."""

    def sources() -> str:
        from importlib import import_module

        return str(import_module("rig.campaign.sources").sources_here())

    return sources


def _name(found: object) -> str:
    return "none" if isinstance(found, ImportError) else str(found)


def _distributed() -> Any:
    try:
        distributed = import_module("distributed")
    except ImportError as error:
        raise ConfigError(
            "a cluster needs the package distributed: pip install 'activerig[cluster]'"
        ) from error
    # A lost connection is reported once, by what it means for the campaign.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    return distributed
