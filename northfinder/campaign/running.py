"""Shares the chunks of a campaign out: over this machine's cores, or over a Dask cluster."""

import os
import signal
from collections.abc import Callable, Collection, Generator, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import TypeVar

from northfinder.campaign.chunks import one_thread
from northfinder.campaign.dask_cluster import dask_cluster
from northfinder.campaign.errors import CampaignError
from northfinder.campaign.settings import Campaign

R = TypeVar("R")

_AHEAD = 3  # chunks for each worker: the next is there when one is done, and no heap of results
#: Processes start in a second or two, then each has a whole core; threads wait for one another
#: between numpy's calls (measured: 1.3 times one thread, processes 1.9 times).
_WORTH_PROCESSES = 50


def chunk_results(
    campaign: Campaign,
    work: Callable[[Campaign, int], R],
    dask_address: str | None = None,
    finished: Collection[int] = (),
) -> Generator[tuple[int, R]]:
    """Do something with each chunk that is not finished, and yield what comes of it as it comes.

    Args:
        campaign: What to draw.
        work: What to do with the campaign and the number of a chunk; a module's function, for it
            may be done in other processes.
        dask_address: Of a Dask scheduler; None: the cores of this machine.
        finished: Chunks to leave out.

    Yields:
        Number and outcome of each chunk, in no particular order.

    Raises:
        ConfigError: Dask is not installed, or the address is none.
        CampaignError: Nobody answers there, or those who compute gave up.
        EstimationError: The plan does not determine north.
    """
    left_out = set(finished)
    wanted = [chunk for chunk in range(campaign.chunks) if chunk not in left_out]
    if not wanted:
        return
    with _cores(len(wanted)) if dask_address is None else dask_cluster(dask_address) as pool:
        executor, workers = pool
        todo = partial(work, campaign)
        yield from _shared_out(executor, todo, workers * _AHEAD, iter(wanted))


@contextmanager
def _cores(chunks: int) -> Iterator[tuple[Executor, int]]:
    workers = min(core_count(), chunks)
    pool: Executor
    if chunks < _WORTH_PROCESSES:
        pool = ThreadPoolExecutor(workers, "campaign")
    else:
        pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin_process)
    try:
        with one_thread():
            yield pool, workers
    except BrokenExecutor as error:
        msg = "a process that computed chunks ended; is there memory enough?"
        raise CampaignError(msg) from error
    finally:
        pool.shutdown(cancel_futures=True)  # waits for what is under way, leaves out the rest


def core_count() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _begin_process() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _shared_out(
    pool: Executor, work: Callable[[int], R], at_once: int, wanted: Iterator[int]
) -> Iterator[tuple[int, R]]:
    running: dict[Future[R], int] = {}
    while True:
        while len(running) < at_once and (chunk := next(wanted, None)) is not None:
            running[pool.submit(work, chunk)] = chunk
        if not running:
            return
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            yield running.pop(future), future.result()
