"""The one door to other processes and machines: who makes trials.

`local` makes them in this process, or by loky, which comes with joblib, in processes of
this machine; `dask` has the workers of a Dask cluster make them. Calls and their
arguments are sent to workers, results are sent back, and only this process writes to
the study's folder: a worker needs no file of it, nor the same home.
"""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context
from queue import SimpleQueue
from typing import Any

from mrmg.errors import MachineError, UsageError, require_known
from mrmg.extras import import_extra
from mrmg.interruption import end_with_parent, sheltered_children

Call = Callable[[Any, Any], Any]
"""A function of a module that makes a trial."""

Jobs = Sequence[tuple[Any, Any]]
"""Arguments of calls; what several of them share comes first."""

Results = Iterator[tuple[int, Any]]
"""The place of each job and what came of it, as they come."""

ENGINES = ("local", "dask")

CONNECT_S = 15.0
"""How long a scheduler is waited for [s]."""

_GO_ON = "the same command goes on from the trials that are done"


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """Who makes trials.

    Attributes:
        kind: one of `ENGINES`.
        workers: trials under way at once; None for one on this machine, and as many as
            a cluster has room for.
        scheduler: address of a Dask scheduler; None starts a cluster on this machine.
    """

    kind: str = "local"
    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        require_known("engine", self.kind, ENGINES)
        if self.workers is not None and self.workers < 1:
            raise UsageError(f"workers = {self.workers}; at least 1 is needed")
        if self.scheduler is not None and self.kind != "dask":
            raise UsageError(
                "a scheduler is one of Dask; use --engine dask with --scheduler"
            )

    def results(self, call: Call, jobs: Jobs) -> Results:
        """Yield the place of each job and what `call` returns for it, as they come.

        Args:
            call: function of a module.
            jobs: arguments of the calls; what several of them share is sent to a
                machine once.

        Raises:
            MachineError: if workers were killed, or the cluster is out of reach.
        """
        if not jobs:
            return
        if self.kind == "dask":
            yield from self._by_dask(call, jobs)
        elif (self.workers or 1) == 1:
            for number, job in enumerate(jobs):
                yield number, call(*job)
        else:
            yield from self._by_processes(call, jobs)

    def _by_processes(self, call: Call, jobs: Jobs) -> Results:
        from joblib.externals.loky import ProcessPoolExecutor

        # loky warns where it replaces a process that has come to hold much memory.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs")
        pool = ProcessPoolExecutor(
            min(self.workers or 1, len(jobs)),
            initializer=end_with_parent,
            initargs=(os.getpid(),),
        )

        def submit(*job: Any) -> Any:
            with sheltered_children():
                return pool.submit(_numbered, call, *job)

        # The first lock starts Python's resource tracker, which lifts signal masks.
        get_context("spawn").Lock()
        try:
            yield from _as_they_come(submit, jobs, 2 * (self.workers or 1))
        except BrokenProcessPool as error:
            raise MachineError(
                f"a worker process was killed (out of memory?); {_GO_ON}, fewer "
                "--workers need less memory"
            ) from error
        finally:
            pool.shutdown(kill_workers=True)

    def _by_dask(self, call: Call, jobs: Jobs) -> Results:
        purpose = "has workers on other machines make trials"
        dask = import_extra("distributed", extra="cluster", purpose=purpose)
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        client = self._client(dask)
        try:
            shared = {
                id(part): client.submit(_itself, part, pure=False)
                for part in {id(part): part for part, _ in jobs}.values()
            }

            def submit(number: int, part: Any, item: Any) -> Any:
                job = (call, number, shared[id(part)], item)
                return client.submit(_numbered, *job, pure=False)

            yield from _as_they_come(submit, jobs, self.workers)
        except (CancelledError, OSError, TimeoutError) as error:
            raise MachineError(f"the Dask scheduler was lost; {_GO_ON}") from error
        except dask.scheduler.KilledWorker as error:
            raise MachineError(
                f"a trial ended one worker after the other (out of memory?); {_GO_ON}"
            ) from error
        except ModuleNotFoundError as error:
            raise MachineError(
                f"a worker has no package {error.name}; install the same packages "
                "wherever workers run"
            ) from error
        finally:
            with suppress(TimeoutError):  # of a scheduler that is gone
                client.close(timeout=CONNECT_S)

    def _client(self, dask: Any) -> Any:
        """Return a client of the cluster."""
        if self.scheduler is None:
            return dask.Client(
                n_workers=self.workers or 1,
                threads_per_worker=1,
                dashboard_address=None,
            )
        try:
            return dask.Client(self.scheduler, timeout=CONNECT_S)
        except (OSError, TimeoutError, ValueError) as error:
            raise MachineError(
                f"no Dask scheduler answers at {self.scheduler}; 'dask scheduler' "
                "starts one and prints its address, such as tcp://host:8786"
            ) from error


def _as_they_come(submit: Callable[..., Any], jobs: Jobs, ahead: int | None) -> Results:
    """Yield what comes of jobs as they end, in whatever order.

    Args:
        submit: takes a job's place and arguments, and returns a future of its result.
        jobs: arguments of the calls.
        ahead: how many are submitted at once; None for all.
    """
    waiting = enumerate(jobs)
    ended: SimpleQueue[Any] = SimpleQueue()

    def submit_next(count: int | None) -> None:
        for number, job in islice(waiting, count):
            submit(number, *job).add_done_callback(ended.put)

    submit_next(ahead)
    for _ in jobs:
        future = ended.get()
        submit_next(1)
        yield future.result()


def _numbered(call: Call, number: int, part: Any, item: Any) -> tuple[int, Any]:
    return number, call(part, item)


def _itself(value: Any) -> Any:
    return value
