# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Dask: workers here or elsewhere, and orders that are carried out by them whatever happens to them."""

import logging
import math
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from itertools import islice
from time import monotonic, sleep
from typing import Any, NamedTuple
from uuid import uuid4

import dask
from dask.distributed import Client, Future, LocalCluster, as_completed
from distributed.scheduler import KilledWorker

from .worker import task
from .worker.process import FAILED

# Ctrl+C goes to all processes of a terminal, and is for the one that ends the others.
DEAF = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
# What Dask measures of itself all the time takes some hundredths of a processor, for each process.
CALM = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}
AHEAD = 3  # orders that are out at once, for each thread of a worker
LEAST_AHEAD = 16
LOOK_EVERY = 5.0  # seconds between looks at how many threads there are
GONE = "The worker was lost with it again and again"
CONNECT = 60.0  # seconds in which a scheduler that was restarted may come back


class EngineError(Exception):
    """There is no scheduler, or none any more, or it is none for this; a sentence."""


class Order(NamedTuple):
    """What a worker is to do: `label` names object and block, `name` and `arguments` are as in hand.py."""

    label: str
    name: str
    arguments: tuple[Any, ...]


class Outcome(NamedTuple):
    """How an order went, what came of it, and what went wrong before."""

    order: Order
    how: str
    value: Any
    troubles: list[str]


@contextmanager
def connected(scheduler: str | None, workers: int, dashboard: str | None) -> Iterator[Client]:
    """A client of the scheduler at an address, or of one with so many workers on this machine."""
    if scheduler is None:
        with (
            dask.config.set(CALM),
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                silence_logs=logging.ERROR,
                preload=[DEAF],
                dashboard_address=dashboard or "127.0.0.1:0",
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
    """Has orders carried out by the workers of a client's scheduler, few of them out at once.

    limit : seconds that an order may take
    threads : of all workers there are, or were a little while ago
    """

    def __init__(self, client: Client, limit: float) -> None:
        self.client, self.limit = client, limit
        self._run, self._number = uuid4().hex, 0
        self._looked, self.threads = -math.inf, 0

    def performed(self, orders: Iterable[Order]) -> Iterator[Outcome]:
        """Each outcome as it comes.

        What is lost with a worker, or with a scheduler that is restarted, is ordered again. Raises
        EngineError where the scheduler does not come back.
        """
        waiting, out = iter(orders), {}
        running = as_completed()
        while True:
            for order in islice(waiting, self._room() - len(out)):
                self._submit(order, out, running)
            if not out:
                return
            batch = {future: out.pop(future) for future in running.next_batch()}
            outcomes = self._outcomes(batch)
            for future, order in batch.items():
                if future in outcomes:
                    yield Outcome(order, *outcomes[future])
                else:
                    self._submit(order, out, running)

    def _submit(self, order: Order, out: dict[Future, Order], running: as_completed) -> None:
        self._require_scheduler()
        self._number += 1
        # The first part is what the scheduler groups tasks by; the label is what its logs tell.
        key = (f"{order.name}-{self._run}", order.label, self._number)
        words = (order.label, self.limit, order.name, *order.arguments)
        future = self.client.submit(task.perform, *words, key=key, pure=False)
        out[future] = order
        running.add(future)

    def _outcomes(self, futures: Iterable[Future]) -> dict[Future, tuple[str, Any, list[str]]]:
        """How it went, by future; those that are lost are left out."""
        found = {}
        finished = [future for future in futures if future.status == "finished"]
        with suppress(CancelledError, OSError, TimeoutError):
            found |= zip(finished, self.client.gather(finished), strict=True)
        for future in futures:
            if future.status == "error":
                error = future.exception()
                if not isinstance(error, KilledWorker):
                    words = " ".join(str(error).split()).partition(". ")[0]
                    raise EngineError(
                        f"the scheduler or a worker cannot take orders ({words}): start them in the same "
                        "environment, with this checkout on their PYTHONPATH"
                    ) from error
                found[future] = FAILED, GONE, [f"{future.key[1]}: {GONE}"]
        return found

    def _room(self) -> int:
        """How many orders may be out at once."""
        if monotonic() - self._looked > LOOK_EVERY:
            self._looked = monotonic()
            self._require_scheduler()
            with suppress(OSError, TimeoutError):
                workers = self.client.scheduler_info(n_workers=-1)["workers"].values()
                self.threads = sum(worker["nthreads"] for worker in workers)
        return max(LEAST_AHEAD, AHEAD * self.threads)

    def _require_scheduler(self) -> None:
        """Waits for a scheduler that was restarted."""
        while self.client.status == "connecting":
            sleep(0.1)
        if self.client.status != "running":
            raise EngineError("the scheduler is gone: start it again, and then this command")
