"""Studies on a real Dask cluster of processes: workers that are killed, and none at all."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from gaitopt import InputError, StudyError, StudyWarning
from gaitopt.errors import warn
from gaitopt.studies import cluster
from gaitopt.studies.cluster import on_cluster

distributed = pytest.importorskip("distributed")


def square_and_pid(number: int) -> tuple[int, int]:
    time.sleep(0.02)
    return number * number, os.getpid()


def one_of_one_kind(number: int) -> int:
    raise ModuleNotFoundError("No module named 'gaitopt'")


@pytest.fixture(scope="module")
def two_workers() -> Any:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as found:
        yield found


def results(address: str, work: Any = square_and_pid, count: int = 40, **more: Any) -> list[Any]:
    given = on_cluster(address, work, range(count), lambda n: (n,), lambda reason: reason, **more)
    return list(given)


def test_a_worker_that_is_killed_half_way_costs_no_result(two_workers: Any) -> None:
    found, killed = [], None
    given = on_cluster(two_workers.scheduler_address, square_and_pid, range(60), lambda n: (n,),
                       lambda reason: reason)  # fmt: skip
    for number, (square, pid) in given:
        assert square == number * number
        found.append(number)
        if len(found) == 10:
            killed = pid
            time.sleep(0.5)  # so that it has done jobs whose results nobody has fetched
            os.kill(pid, signal.SIGKILL)
    assert killed not in (None, os.getpid())
    assert sorted(found) == list(range(60))


def test_what_workers_cannot_run_is_one_error(two_workers: Any) -> None:
    with pytest.raises(StudyError, match="cannot run this study: ModuleNotFoundError: No module"):
        results(two_workers.scheduler_address, one_of_one_kind, 3)


def test_the_only_thread_of_a_cluster_is_used_and_not_this_process() -> None:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    ) as found:
        pids = {pid for _, (_, pid) in results(found.scheduler_address, count=4)}
    assert len(pids) == 1 and os.getpid() not in pids


def test_a_scheduler_without_workers_is_waited_for_and_then_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cluster, "WAIT", 1.0)
    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as found:
        address = found.scheduler_address
        with (
            pytest.warns(StudyWarning, match="waiting 1 s for one; start one with: dask worker"),
            pytest.raises(StudyError, match="no worker came to the Dask scheduler"),
        ):
            results(address)


def test_a_scheduler_that_goes_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "LOST", 0.5)
    found = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    )
    closing = threading.Thread(target=found.close)
    try:
        given = on_cluster(found.scheduler_address, square_and_pid, range(20_000), lambda n: (n,),
                           lambda reason: reason)  # fmt: skip
        next(given)
        closing.start()
        with pytest.raises(StudyError, match=r"does not answer any more|has lost its|no worke"):
            list(given)
    finally:
        # Two that close it at the same time are too many for Dask.
        if closing.ident is None:
            closing.start()
        closing.join()


def test_a_scheduler_that_goes_while_a_worker_is_waited_for_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cluster, "LOST", 0.5)
    found = distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None)
    closing = threading.Thread(target=found.close)

    def told(words: str, kind: type[Warning]) -> None:
        warn(words, kind)
        closing.start()  # not before somebody waits

    monkeypatch.setattr(cluster, "warn", told)
    try:
        with (
            pytest.warns(StudyWarning, match="no worker at"),
            pytest.raises(StudyError, match="does not answer any more"),
        ):
            results(found.scheduler_address)
    finally:
        if closing.ident is None:
            closing.start()
        closing.join()


def test_what_is_no_address(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no Dask scheduler answers at nowhere"):
        results("nowhere://1")
