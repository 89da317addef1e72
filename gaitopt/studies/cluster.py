"""Jobs of a study on a Dask cluster, whose machines may come late, leave, or never be there."""

from __future__ import annotations

import logging
import queue
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import Any, Final, TypeVar

from gaitopt.errors import InputError, MissingPackageError, StudyError, StudyWarning, warn

ANSWER: Final = 10.0
"""Time in which a scheduler must answer [s]. Chosen here."""
WAIT: Final = 60.0
"""Time in which the first worker must join, and another one where all have left [s]. Chosen: queues
of clusters that are idle start a worker within a minute."""
LOST: Final = 5.0
"""Time after which a scheduler that does not answer counts as lost [s]. Chosen here."""
LOOK_EVERY: Final = 0.5
"""Time between two looks at the cluster [s]. Chosen here."""
MOST_LOST: Final = 5
"""Times that a job's result may be lost with the worker that has it. Chosen here."""
GONE: Final = object()
"""In place of a result that was lost with the worker that had it."""
AHEAD: Final = 3
"""Jobs that are sent for each thread of the cluster, so that none is idle. Chosen here."""

J = TypeVar("J")


def on_cluster(
    address: str, work: Callable[..., Any], jobs: Sequence[J], arguments: Callable[[J], Any],
    failed: Callable[[str], Any], *, most: int = -1,
) -> Generator[tuple[J, Any], None, None]:  # fmt: skip
    """Results of a function for many jobs, in any order, computed on a cluster.

    A job whose worker is ended goes to another worker, also where the worker had done it and takes
    the result with it. All threads of the cluster are used, also where there is only one.

    Args:
        address: of the Dask scheduler, as ``tcp://host:8786``.
        work: the function; it raises nothing.
        jobs: what to compute.
        arguments: the tuple of arguments of a job.
        failed: makes the result of a job that ended worker after worker; takes the reason.
        most: largest number of jobs that run at the same time; -1 for no limit.

    Raises:
        InputError: no scheduler answers there.
        MissingPackageError: Dask is not installed.
        StudyError: the scheduler was lost, no worker is there, or workers cannot run the function.
    """
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            "a Dask scheduler needs the package distributed: pip install 'gaitopt[cluster]'"
        ) from error
    with _silent(), _client(address) as client:
        cluster = _Cluster(client, address)
        waiting = [(job, 0) for job in reversed(jobs)]
        running: dict[str, tuple[J, int, Any]] = {}
        done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        while waiting or running:
            limit = most if most > 0 else AHEAD * cluster.threads()
            while waiting and len(running) < limit:
                job, lost = waiting.pop()
                future = client.submit(work, *arguments(job), pure=False)
                running[future.key] = job, lost, future
                future.add_done_callback(done.put)
            try:
                finished = done.get(timeout=LOOK_EVERY)
            except queue.Empty:
                cluster.check()
                continue
            job, lost, future = running.pop(finished.key)
            result = cluster.result(future, failed)
            if result is GONE:
                if lost == MOST_LOST:
                    raise StudyError(f"the Dask scheduler at {address} has lost its jobs")
                waiting.append((job, lost + 1))
                continue
            yield job, result


class _Cluster:
    """What is known of a cluster while jobs run on it."""

    def __init__(self, client: Any, address: str) -> None:
        self.client, self.address = client, address
        self.deserted: float | None = None
        """Since when no worker is there."""
        while not self.threads():
            self.check()
            time.sleep(LOOK_EVERY)

    def threads(self) -> int:
        """Threads of all workers; none where the scheduler was lost, which :meth:`check` tells."""
        if self.client.status != "running":
            return 0  # to ask would wait for an answer
        try:
            told = self.client.scheduler_info(n_workers=-1)
        except TypeError:  # before Dask had this argument, all workers were told
            told = self.client.scheduler_info()
        except OSError:
            return 0
        # After the connection was lost, nothing is known of workers.
        return sum(int(worker["nthreads"]) for worker in told.get("workers", {}).values())

    def check(self) -> None:
        """Raises StudyError where the scheduler is lost, or no worker came in time."""
        begin = time.monotonic()
        while self.client.status != "running":
            if time.monotonic() - begin > LOST:
                raise StudyError(f"the Dask scheduler at {self.address} does not answer any more")
            time.sleep(0.1)
        if self.threads():
            self.deserted = None
        elif self.deserted is None:
            self.deserted = begin
            warn(
                f"no worker at {self.address}: waiting {WAIT:.0f} s for one; start one with: dask "
                f"worker {self.address}",
                StudyWarning,
            )
        elif begin - self.deserted > WAIT:
            raise StudyError(
                f"no worker came to the Dask scheduler at {self.address} within {WAIT:.0f} s; "
                f"start one with: dask worker {self.address}"
            )

    def result(self, future: Any, failed: Callable[[str], Any]) -> Any:
        """The result of a future that has ended; ``GONE`` if it was lost with its worker.

        Raises:
            StudyError: it was lost with the scheduler, or the worker could not run it.
        """
        from distributed import KilledWorker

        status = future.status
        with suppress(OSError, CancelledError):  # its worker has left, or the scheduler
            if status == "finished":
                return future.result(timeout=WAIT)
        if status == "error":
            error = future.exception(timeout=ANSWER)
            if isinstance(error, KilledWorker):
                return failed("the workers that ran it were ended from outside, again and again")
            raise StudyError(
                f"the workers at {self.address} cannot run this study: {type(error).__name__}: "
                f"{error}; install the same gaitopt there"
            )
        self.check()
        return GONE


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """A connection with a scheduler."""
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"no Dask scheduler answers at {address}: {error}") from error
    try:
        yield client
    finally:
        with suppress(Exception):  # a scheduler that is lost cannot be told goodbye
            client.close(timeout=2)  # type: ignore[no-untyped-call]


@contextmanager
def _silent() -> Iterator[None]:
    """Keep Dask's many lines about lost connections from the terminal: one error says it.

    Dask has given its loggers levels of their own.
    """
    names = ("distributed", "tornado", "asyncio")
    loggers = [logging.getLogger(name) for name in [*names, *logging.root.manager.loggerDict]
               if name.split(".")[0] in names]  # fmt: skip
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
