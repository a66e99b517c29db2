# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Dask: workers here or elsewhere, who carry out orders; what is lost with one of them is ordered again."""

import logging
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from time import sleep
from typing import Any, NamedTuple
from uuid import uuid4

import dask
from dask.distributed import Client, Future, LocalCluster, as_completed
from distributed.scheduler import KilledWorker

from .worker import task
from .worker.process import FAILED

# What workers run first. Ctrl+C reaches all processes of a terminal, but only one should end the others. And
# a worker must not print that its scheduler ended during a heartbeat, as may happen at the end of each run.
PRELOAD = """
import logging
import signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
logging.getLogger("distributed").setLevel(logging.CRITICAL)
"""
# Dask's measurements of itself would take some hundredths of a processor for each process.
CALM = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}
GONE = "The worker was lost with it again and again"
CONNECT = 60.0  # A scheduler that was restarted may come back within this many seconds.


class EngineError(Exception):
    """There is no scheduler, or it is gone, or does not suit; the message is a sentence."""


class Order(NamedTuple):
    """What a worker has to do: `label` names object and block, `name` and `arguments` are as in hand.py."""

    label: str
    name: str
    arguments: tuple[Any, ...]


class Outcome(NamedTuple):
    """How an order went, its result, and what went wrong before."""

    order: Order
    how: str
    value: Any
    troubles: list[str]


@contextmanager
def connected(scheduler: str | None, workers: int) -> Iterator[Client]:
    """A client of the scheduler at an address, or of a new one with `workers` workers on this machine."""
    if scheduler is None:
        with (
            dask.config.set(CALM),
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                silence_logs=logging.ERROR,
                preload=[PRELOAD],
                dashboard_address="127.0.0.1:0",
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(scheduler, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise EngineError(f'no scheduler answers at "{scheduler}" ({error}): start one there') from error
    with client:
        yield client


class Engine:
    """Gives orders to the workers of a client's scheduler.

    limit : seconds that an order may take
    """

    def __init__(self, client: Client, limit: float) -> None:
        self.client, self.limit = client, limit
        self._run, self._number = uuid4().hex, 0

    def performed(self, orders: Iterable[Order]) -> Iterator[Outcome]:
        """Yields each outcome as it comes.

        What is lost with a worker, or with a scheduler that is restarted, is ordered again. Raises
        EngineError if the scheduler does not come back.
        """
        out = {self._submitted(order): order for order in orders}
        running = as_completed(list(out))
        for future in running:
            order = out.pop(future)
            if (outcome := _outcome(future, order)) is not None:
                yield outcome
            else:
                again = self._submitted(order)
                out[again] = order
                running.add(again)

    @property
    def threads(self) -> int:
        """The number of threads of all workers, 0 while the scheduler does not answer."""
        with suppress(OSError, TimeoutError):
            workers = self.client.scheduler_info(n_workers=-1)["workers"].values()
            return sum(worker["nthreads"] for worker in workers)
        return 0

    def _submitted(self, order: Order) -> Future[Any]:
        self._require_scheduler()
        self._number += 1
        # The scheduler groups tasks by the first part, and its logs show the label.
        key = (f"{order.name}-{self._run}", order.label, self._number)
        words = (order.label, self.limit, order.name, *order.arguments)
        return self.client.submit(task.perform, *words, key=key, pure=False)

    def _require_scheduler(self) -> None:
        """Waits for a scheduler that was restarted."""
        while self.client.status == "connecting":
            sleep(0.1)
        if self.client.status != "running":
            raise EngineError("the scheduler is gone: start it again, and then this command")


def _outcome(future: Future[Any], order: Order) -> Outcome | None:
    """How an order went, or None if it is lost. Raises EngineError if it cannot be taken."""
    if future.status == "finished":
        with suppress(CancelledError, OSError, TimeoutError):
            return Outcome(order, *future.result())
    if future.status != "error":
        return None
    error = future.exception()
    if isinstance(error, KilledWorker):
        return Outcome(order, FAILED, GONE, [f"{order.label}: {GONE}"])
    words = " ".join(str(error).split()).partition(". ")[0]
    raise EngineError(
        f"the scheduler or a worker cannot take orders ({words}): start them in the same environment, with "
        "this checkout on their PYTHONPATH"
    ) from error
