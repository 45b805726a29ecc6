"""Workers for the runs: processes of this machine, or a Dask cluster. Both are executors."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import TypeVar

from flockwire_core.extras import remedy
from flockwire_core.swarm.wording import InputError

Task = TypeVar("Task")
Result = TypeVar("Result")
PATIENCE = 10.0  # s for a scheduler to answer with a worker


class WorkersLostError(RuntimeError):
    """The workers failed; the text gives the reason."""


@dataclass(frozen=True, slots=True)
class Workers:
    """An executor and its number of concurrent runs."""

    executor: Executor
    count: int


@contextmanager
def local(jobs: int) -> Iterator[Workers]:
    """Start processes of this machine; they end with the block, and with this process for any cause."""
    os.environ["PYTHONSAFEPATH"] = "1"  # they import nothing from the current folder
    spawn = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(jobs, mp_context=spawn, initializer=_serve)
    try:
        yield Workers(executor, jobs)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


@contextmanager
def cluster(address: str) -> Iterator[Workers]:
    """Connect to the Dask scheduler at `address`; raises InputError if there is none, or it has no workers."""
    try:
        from distributed import Client  # noqa: PLC0415  (an optional extra)
    except ImportError:
        line = f"--scheduler = {address}: needs the package distributed: {remedy('study')}"
        raise InputError(line) from None
    for name in ("distributed.client", "distributed.core", "distributed.comm"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # an error is reported in one line
    try:
        client = Client(  # type: ignore[no-untyped-call]
            address, timeout=PATIENCE, set_as_default=False
        )
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).split("\n")[0] or type(error).__name__
        raise InputError(f"--scheduler = {address}: no Dask scheduler answers there: {reason}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise InputError(f"--scheduler = {address}: the scheduler has no workers") from None
        cores = sum(client.nthreads().values())  # type: ignore[no-untyped-call]
        with client.get_executor(pure=False) as executor:  # type: ignore[no-untyped-call]
            try:
                yield Workers(executor, cores)
            finally:
                executor.shutdown(wait=False)  # which cancels runs that have not started


def conduct(tasks: Iterable[Task], workers: Workers, fly: Callable[[Task], Result]) -> Iterator[Result]:
    """Fly all tasks, in any order they end; raises WorkersLostError."""
    ahead = 3  # runs in the queue for each worker
    waiting = iter(tasks)
    running: set[Future[Result]] = set()
    while True:
        room = ahead * workers.count - len(running)
        try:
            running |= {workers.executor.submit(fly, task) for task in islice(waiting, room)}
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            results = [future.result() for future in finished]
        except (Exception, CancelledError) as error:  # a flight raises nothing: the error is the executor's
            raise WorkersLostError(f"the workers are gone ({type(error).__name__}: {error})") from error
        yield from results
        if not (running or results):
            return


def _serve() -> None:
    """Initialise a worker: its parent handles Ctrl-C, and it ends when its parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
