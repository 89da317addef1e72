"""Tables of many jobs on all cores, which can be continued: one process appends the rows."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Protocol, TypeVar

from gaitopt.errors import InputError, MissingPackageError
from gaitopt.files import StrPath, written_whole
from gaitopt.studies.tables import appending
from gaitopt.studies.workers import no_workers_left


class Job(Protocol):
    """A dataclass of plain values."""

    @property
    def key(self) -> str:
        """Hash of all fields, by which a table knows the jobs that are done."""
        ...


J = TypeVar("J", bound=Job)


def key_of(job: Any) -> str:
    """Hash of all fields of a dataclass."""
    text = json.dumps(asdict(job), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def header_of(job: type[Any], row: type[Any]) -> tuple[str, ...]:
    """Columns of the table: the key, the fields of a job and those of its result."""
    return ("key", *(f.name for f in fields(job)), *(f.name for f in fields(row)))


def run_jobs(
    waiting: Sequence[J],
    run: Callable[[J], Any],
    header: tuple[str, ...],
    table: StrPath,
    *,
    jobs: int = -1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, str]]:
    """Run all jobs that are not in the table yet, and append a row for each.

    Args:
        waiting: the jobs.
        run: makes the result of a job, a dataclass; it raises nothing.
        header: of :func:`header_of`.
        table: a CSV file, which is made if it does not exist. A last line that a crash has cut off
            is deleted, and its job is run again.
        jobs: number of processes; -1 for one on each core. There are never more than cores.
        scheduler: address of a Dask scheduler (``tcp://...``), to compute there and not here.
        progress: called with (jobs done, jobs in all).

    Returns:
        All rows of the table that belong to the jobs, as text by column.

    Raises:
        InputError: the table cannot be read or written, or is no table of this study; or no
            scheduler answers.
        MissingPackageError: a scheduler was named, and Dask is not installed.
    """
    from joblib import Parallel, cpu_count, delayed

    path = Path(table)
    done = {row["key"]: row for row in _rows_so_far(path, header)}
    left = [job for job in dict.fromkeys(waiting) if job.key not in done]
    count = len(waiting) - len(left)
    if progress is not None:
        progress(count, len(waiting))
    workers = jobs if scheduler is not None else min(jobs, cpu_count())
    with no_workers_left(), _backend(scheduler), appending(path, header) as append:
        results = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1)(
            delayed(_job_and_row)(run, job) for job in left
        )
        for job, row in results:
            values = {"key": job.key, **asdict(job), **asdict(row)}
            text = {name: _text(values[name]) for name in header}
            append(text)
            done[job.key] = text
            count += 1
            if progress is not None:
                progress(count, len(waiting))
    return [done[job.key] for job in dict.fromkeys(waiting)]


def _job_and_row(run: Callable[[J], Any], job: J) -> tuple[J, Any]:
    """A job with its result, since workers return results in any order."""
    return job, run(job)


@contextmanager
def _backend(scheduler: str | None) -> Iterator[None]:
    """Let joblib compute on a Dask cluster, if the address of a scheduler is given."""
    if scheduler is None:
        yield
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingPackageError(
            "a Dask scheduler needs the package distributed: pip install 'gaitopt[cluster]'"
        ) from error
    from joblib import parallel_config

    try:
        client = Client(scheduler, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client, parallel_config(backend="dask"):
        yield


def _rows_so_far(path: Path, header: tuple[str, ...]) -> list[dict[str, str]]:
    """The rows of a table; a last line without an end is deleted from the file."""
    if not path.exists():
        with written_whole(path) as stream:
            csv.writer(stream, lineterminator="\n").writerow(header)
        return []
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the table {path}: {error}") from error
    whole = text[: text.rfind("\n") + 1]
    rows = list(csv.reader(io.StringIO(whole)))
    if not rows or tuple(rows[0]) != header:
        raise InputError(
            f"{path} is no table of a study, or of another one; name another file, or remove it"
        )
    if whole != text:
        with written_whole(path) as stream:
            stream.write(whole)
    return [dict(zip(header, row, strict=True)) for row in rows[1:] if len(row) == len(header)]


def _text(value: Any) -> str:
    """A value as a cell of the table; all digits of numbers, nothing for ``None``."""
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)
