"""The workers of a call: those of the user, of a scheduler, or local ones, which end with the call."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
import threading
from collections.abc import Iterator

import dask
from distributed import Client, LocalCluster

from .. import _bslam
from . import _interruption
from ._cache import reason_of

_LOOK_S = 10.0  # time between looks for workers


@contextlib.contextmanager
def connected(client: Client | None, scheduler: str | None, workers: int | None, progress: bool) -> Iterator[Client]:
    """The client itself, or one of the scheduler, or of local workers, which end afterwards."""
    with contextlib.ExitStack() as stack:
        if client is None:
            client = _local_client(stack, workers) if scheduler is None else _client_of(stack, scheduler)
        if progress:
            print(f"dashboard: {client.dashboard_link or 'none'}", file=sys.stderr)
            if scheduler is not None:
                stack.enter_context(_watched(client, scheduler))
        yield client


@contextlib.contextmanager
def _watched(client: Client, scheduler: str) -> Iterator[None]:
    """Says it on stderr if there are no workers, also later: workers end if they cannot read a task."""
    ended = threading.Event()

    def watch() -> None:
        workers = True
        while not ended.is_set():
            with contextlib.suppress(Exception):  # a lost scheduler is an error of the tasks
                before, workers = workers, bool(client.nthreads())
                if before and not workers:
                    print(f"no worker is connected to {scheduler}: start some by dask worker", file=sys.stderr)
            ended.wait(_LOOK_S)

    with _interruption.not_in_children():
        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _local_client(stack: contextlib.ExitStack, workers: int | None) -> Client:
    # If a worker is killed, its task is probably not the cause; another worker tries it again.
    stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 100}))
    count = workers or os.cpu_count() or 1
    with _interruption.not_in_children():
        cluster = stack.enter_context(_local_cluster(count))
        cluster.adapt(minimum=count, maximum=count)  # replaces workers that do not come back
        return stack.enter_context(Client(cluster))


def _local_cluster(count: int) -> LocalCluster:
    try:
        return LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=0,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,  # failures of tasks are reported; the rest is about those that end early
        )
    except (OSError, RuntimeError, asyncio.TimeoutError) as error:  # a worker that is killed now is not replaced
        raise _bslam.Error(
            f"the local workers could not be started ({reason_of(error)}); the same command continues"
        ) from error


def _client_of(stack: contextlib.ExitStack, scheduler: str) -> Client:
    try:
        return stack.enter_context(Client(scheduler))
    except ValueError as error:
        raise _bslam.Error(
            f"--scheduler: found {scheduler}, expected an address such as tcp://HOST:8786 ({error})"
        ) from error
    except OSError as error:
        raise _bslam.Error(f"the scheduler {scheduler} cannot be reached: {error}") from error
