"""The folder of one run: chosen before anything is computed, written whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gaitopt.errors import InputError
from gaitopt.files import read_bounded, unfinished, written_whole

ROOT: Final = Path("out")
"""Folder in which runs get folders of their own."""
RECORD: Final = "run.json"
"""File that tells what a folder holds: the command, its files and its verdict."""
RECORD_LIMIT: Final = 1_000_000
"""Largest record that is read [bytes]. Chosen here: those of gaitopt are of a few thousand."""
MOST_RUNS: Final = 10_000
"""Most folders of one name. Chosen: nobody looks through more, and the search for a name ends."""


@dataclass(frozen=True)
class RunFolder:
    """Where a run writes its files.

    Attributes:
        path: the folder; it need not be there yet.
        chosen: whether the user named it. Otherwise it gets a number if another run takes it.
        overwrite: whether files of an earlier run are replaced.
    """

    path: Path
    chosen: bool
    overwrite: bool

    @contextmanager
    def writing(self) -> Iterator[tuple[Path, Path]]:
        """A temporary folder to write into, and the folder in which its files will be.

        The files get to their place when the block ends. After an error, or Ctrl-C, nothing of
        them is left.

        Raises:
            InputError: the folder cannot be written, or holds files of the same names.
        """
        parent = self.path.parent
        try:
            parent.mkdir(parents=True, exist_ok=True)
            made = Path(tempfile.mkdtemp(prefix=f".{self.path.name}.", dir=parent))
        except OSError as error:
            raise _not_writable(self.path, error) from error
        try:
            made.chmod(0o777 & ~_umask())
            place = self._place()
            with unfinished(made):
                yield made, place
                self._move(made, place)
        except OSError as error:
            raise _not_writable(self.path, error) from error
        except InputError as error:
            # The temporary folder is gone when the error is read.
            error.args = tuple(str(a).replace(str(made), str(self.path)) for a in error.args)
            raise
        finally:
            shutil.rmtree(made, ignore_errors=True)

    def settled(self) -> RunFolder:
        """The same with its path decided, for files that are written while the run goes on."""
        return RunFolder(self._place(), True, True)

    def _place(self) -> Path:
        """The folder that files go to: a new one, if the user named none."""
        return self.path if self.chosen else _free(self.path)

    def _move(self, made: Path, place: Path) -> None:
        if not place.exists():
            made.rename(place)
            return
        names = sorted(each.name for each in made.iterdir())
        if self.overwrite:
            _remove_earlier(place, names)
        else:
            _refuse_earlier(place, names)
        for name in names:
            source, target = made / name, place / name
            if target.is_dir():
                for each in source.iterdir():
                    each.replace(target / each.name)
            else:
                source.replace(target)


def run_folder(
    out: Path | None, name: str, overwrite: bool, writes: Sequence[str] = ()
) -> RunFolder:
    """The folder of a run, looked at before the run begins.

    Args:
        out: the folder that the user named; ``None`` for one of this run's own inside ``out/``.
        name: of such a folder, as in ``walk-go2-seed3``.
        overwrite: whether files of an earlier run may be replaced.
        writes: names of the files and folders that the run writes.

    Raises:
        InputError: the folder is a file, cannot be written to, or holds files of another run.
    """
    path = ROOT / name if out is None else out
    _check_writable(path)
    if out is None:
        return RunFolder(path, False, False)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path} is a file, and no folder: give --out another folder")
    if not overwrite:
        _refuse_earlier(path, [*writes, RECORD])
    return RunFolder(path, True, overwrite)


def record_run(folder: Path, document: dict[str, Any]) -> None:
    """Write what a folder holds into its :data:`RECORD`."""
    with written_whole(folder / RECORD) as stream:
        stream.write(json.dumps(document, indent=1, allow_nan=False) + "\n")


def _free(path: Path) -> Path:
    """The first of ``path``, ``path-2``, ``path-3``, ... that is not there."""
    for number in range(1, MOST_RUNS + 1):
        candidate = path if number == 1 else path.with_name(f"{path.name}-{number}")
        if not candidate.exists():
            return candidate
    raise InputError(f"there are {MOST_RUNS} folders {path}: remove some, or give --out")


def _refuse_earlier(path: Path, names: Sequence[str]) -> None:
    """Refuse a folder that holds files which a run would write."""
    for name in names:
        if (path / name).exists():
            raise InputError(
                f"the folder {path} holds {name} of an earlier run: give --out another folder, "
                "leave it out for a new one, or replace the earlier run with --overwrite"
            )


def refuse_existing(*paths: Path | None, overwrite: bool) -> None:
    """Refuse to write files that are there, unless the user said so; ``None`` is no file.

    Raises:
        InputError: a file is there.
    """
    for path in paths:
        if path is not None and path.exists() and not overwrite:
            raise InputError(f"{path} is there: give another name, or replace it with --overwrite")


def refuse_pictures(path: Path) -> None:
    """Refuse a folder that holds pictures: figures of two plans are never mixed.

    Raises:
        InputError: it holds one.
    """
    picture = next(path.glob("*.png"), None)
    if picture is not None:
        _refuse_earlier(path, [picture.name])


def _remove_earlier(path: Path, names: Sequence[str]) -> None:
    """Remove what an earlier run wrote, so that the files of two runs are never mixed.

    These are files of the same names, and of the earlier run's record; in folders, pictures only.
    """
    for name in {*names, *_recorded(path)}:
        earlier = path / name
        if earlier.is_dir():
            for picture in earlier.glob("*.png"):
                picture.unlink()
        else:
            earlier.unlink(missing_ok=True)


def _recorded(path: Path) -> list[str]:
    """Names in the record of an earlier run that lie in its folder."""
    try:
        files = json.loads(read_bounded(path / RECORD, RECORD_LIMIT, InputError))["files"]
        return [str(name) for name in files if Path(str(name)).name == str(name)]
    except (InputError, ValueError, KeyError, TypeError, RecursionError):
        return []


def _check_writable(path: Path) -> None:
    """Refuse a folder that cannot be made, before anything is computed."""
    above = path
    while not above.exists() and above != above.parent:
        above = above.parent
    if above.is_dir() and not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"cannot write into the folder {above}: give --out another one")
    if not above.is_dir() and above != path:
        raise InputError(f"cannot make the folder {path}: {above} is no folder")


def _not_writable(path: Path, error: OSError) -> InputError:
    return InputError(
        f"cannot write the folder {path}: {error.strerror or error}; give --out another one"
    )


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
