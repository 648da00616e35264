"""Hands cases out to processes and keeps what comes back."""

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from drivers.clock import WallClock
from drivers.errors import OperateError
from rig.campaign.cases import Case
from rig.campaign.store import Store
from rig.campaign.worker import Row, ignore_interrupts, run_case

_WRITE_EVERY_S = 5.0
_LOOK_EVERY_S = 0.2
# Handed out ahead, per process: enough to keep it busy, few to wait for when stopped.
_AHEAD = 2


def run_campaign(
    cases: Sequence[Case],
    store: Store,
    rig_file: Path | None,
    assignments: tuple[str, ...],
    jobs: int,
    on_row: Callable[[Row], None],
    stop_requested: Callable[[], bool],
) -> bool:
    """Run what the store lacks of ``cases``; whether all of it is done.

    What is finished is written every few seconds and at the end, however that comes. Raises
    OperateError when a process dies.
    """
    left = store.missing(cases)[::-1]
    clock = WallClock()
    written_s = clock.now_s()
    running: set[Future[Row]] = set()
    # Not forked: compiled code and threads do not survive that.
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), ignore_interrupts)
    try:
        while (left or running) and not stop_requested():
            while left and len(running) < _AHEAD * jobs:
                running.add(pool.submit(run_case, left.pop(), rig_file, assignments))
            done, running = wait(running, _LOOK_EVERY_S, FIRST_COMPLETED)
            for future in done:
                row = future.result()
                store.add(row)
                on_row(row)
            if clock.now_s() - written_s >= _WRITE_EVERY_S:
                store.write()
                written_s = clock.now_s()
    except BrokenProcessPool as error:
        raise OperateError(
            "a process of the campaign died (out of memory?): what is finished is kept; "
            "begin again with the same --out, or with fewer --jobs"
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        store.write()
    return not (left or running)
