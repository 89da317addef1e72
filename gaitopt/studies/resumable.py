"""Tables of many jobs on all cores, which can be continued: one process appends the rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.inputs import as_text
from gaitopt.studies.result_table import Columns, StoredRow, rows_so_far, tell_wrong
from gaitopt.studies.robots import contents_of, expecting
from gaitopt.studies.table_lock import locked
from gaitopt.studies.tables import appending
from gaitopt.studies.workers import no_workers_left, on_all_cores, process_count


class Job(Protocol):
    """A dataclass of plain values."""

    @property
    def robot(self) -> str:
        """Name or path of the job's robot."""
        ...


J = TypeVar("J", bound=Job)


def key_of(job: Any, content: str = "") -> str:
    """Hash of all fields of a job, with the robot's content in place of its name or path.

    Args:
        job: a dataclass of plain values.
        content: fingerprint of the robot; empty for one that cannot be loaded.
    """
    fields = asdict(job)
    if content:
        fields["robot"] = f"sha256:{content}"
    text = json.dumps(fields, sort_keys=True, default=str)
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()[:16]


def run_jobs(
    waiting: Sequence[J],
    run: Callable[[J], Any],
    columns: Columns,
    table: StrPath,
    *,
    jobs: int = -1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, str]]:
    """Run all jobs that are not in the table yet, and append a row for each.

    A row belongs to a job by the job's fields and by the content of its robot: where the robot's
    file has changed, the job is run again.

    Args:
        waiting: the jobs.
        run: makes the result of a job, a dataclass; it raises nothing.
        columns: of the table.
        table: a CSV file, which is made if it does not exist. A last line that a crash has cut off
            is deleted, and its job is run again; lines in the middle that are damaged are told by a
            :class:`gaitopt.errors.StudyWarning`.
        jobs: number of processes; -1 for one on each core. There are never more than cores.
        scheduler: address of a Dask scheduler (``tcp://...``), to compute there and not here.
        progress: called with (jobs done, jobs in all).

    Returns:
        All rows of the table that belong to the jobs, as text by column.

    Raises:
        InputError: the table cannot be read or written, is no table of this study, or another study
            writes to it; ``jobs`` is no number of processes; or no scheduler answers.
        StudyError: workers or the cluster were lost. All rows so far are in the table.
        MissingPackageError: a scheduler was named, and Dask is not installed.
    """
    process_count(jobs)
    try:
        path = Path(table)
    except TypeError:
        raise InputError(f"a table is a file: give a path, got {as_text(table)}") from None
    if not path.name or path.is_dir():
        raise InputError(f"a table is a file, and {path} is a folder; name a file in it")
    with locked(path):
        contents = contents_of(job.robot for job in waiting)
        keys = {job: key_of(job, contents[job.robot]) for job in waiting}
        done = _done(keys, rows_so_far(path, columns), path)
        left = [job for job in keys if keys[job] not in done]
        count = len(waiting) - len(left)
        if progress is not None:
            progress(count, len(waiting))
        work = partial(_run, run, contents)
        results = (
            _here(work, left, jobs)
            if scheduler is None
            else _there(work, left, columns, scheduler, jobs)
        )
        with no_workers_left(), closing(results), appending(path, columns.names) as append:
            for job, row in results:
                text = _cells(keys[job], job, row)
                append(text)
                done[keys[job]] = text
                count += 1
                if progress is not None:
                    progress(count, len(waiting))
    return [done[keys[job]] for job in keys]


def _here(
    work: Callable[..., Any], left: Sequence[J], jobs: int
) -> Generator[tuple[J, Any], None, None]:
    """Jobs and results from the cores of this machine."""
    with closing(on_all_cores(work, ((job,) for job in left), jobs)) as results:
        yield from results


def _there(
    work: Callable[..., Any], left: Sequence[J], columns: Columns, scheduler: str, jobs: int
) -> Generator[tuple[J, Any], None, None]:
    """Jobs and results from a Dask cluster."""
    from gaitopt.studies.cluster import on_cluster

    def failed(reason: str) -> Any:
        return columns.row("error", reason)

    given = on_cluster(scheduler, work, left, lambda job: (job,), lambda r: (None, failed(r)),
                       most=jobs)  # fmt: skip
    with closing(given) as results:
        for job, (_, row) in results:
            yield job, row


def _run(run: Callable[[J], Any], contents: Mapping[str, str], job: J) -> tuple[J, Any]:
    """A job with its result, in a worker process."""
    with expecting(contents):
        return job, run(job)


def _done(
    keys: Mapping[J, str], rows: Mapping[str, StoredRow], path: Path
) -> dict[str, dict[str, str]]:
    """The rows of jobs, without those whose fields are not the job's: somebody changed them."""
    found, changed = {}, []
    for job, key in keys.items():
        if key not in rows:
            continue
        line, row = rows[key]
        fields: dict[str, Any] = asdict(job)  # type: ignore[call-overload]
        own = {name: _text(value) for name, value in fields.items() if name != "robot"}
        if all(row[name] == value for name, value in own.items()):
            found[key] = row
        else:
            changed.append(line)
    tell_wrong(path, changed, "fields that are not those of the line's key")
    return found


def _cells(key: str, job: Any, row: Any) -> dict[str, str]:
    """A row of the table."""
    values = {"key": key, **asdict(job), **asdict(row)}
    return {name: _text(value) for name, value in values.items()}


def _text(value: Any) -> str:
    """A value as a cell of the table; all digits of numbers, nothing for ``None``."""
    if value is None:
        return ""
    return repr(float(value)) if isinstance(value, float) else " ".join(str(value).split())
