"""Files appear whole or not at all, and foreign ones are read with a bound."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path

import pytest

import gaitopt
from gaitopt.errors import (
    FootholdsError,
    GaitoptError,
    GroundError,
    InputError,
    PlanFileError,
)
from gaitopt.files import read_bounded, written_whole


def files_in(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_text_is_written_as_utf8_with_the_line_ends_it_was_given(tmp_path: Path) -> None:
    with written_whole(tmp_path / "a.txt") as stream:
        stream.write("größe\nzwei\r\n")
    assert (tmp_path / "a.txt").read_bytes() == "größe\nzwei\r\n".encode()
    assert files_in(tmp_path) == ["a.txt"]


def test_bytes_are_written_as_they_are(tmp_path: Path) -> None:
    with written_whole(tmp_path / "a.bin", binary=True) as stream:
        stream.write(bytes(range(256)))
    assert (tmp_path / "a.bin").read_bytes() == bytes(range(256))


def test_path_may_be_a_string(tmp_path: Path) -> None:
    with written_whole(str(tmp_path / "a.txt")) as stream:
        stream.write("x")
    assert read_bounded(str(tmp_path / "a.txt"), 10, InputError) == b"x"


def test_others_may_read_the_file(tmp_path: Path) -> None:
    with written_whole(tmp_path / "a.txt") as stream:
        stream.write("x")
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o644


def test_file_is_not_there_before_the_block_ends(tmp_path: Path) -> None:
    with written_whole(tmp_path / "a.txt") as stream:
        stream.write("x")
        stream.flush()
        assert not (tmp_path / "a.txt").exists()
    assert (tmp_path / "a.txt").exists()


@pytest.mark.parametrize("failure", [RuntimeError("half way"), KeyboardInterrupt(), SystemExit(3)])
def test_failure_half_way_leaves_nothing(tmp_path: Path, failure: BaseException) -> None:
    with pytest.raises(type(failure)), written_whole(tmp_path / "a.txt") as stream:
        stream.write("half")
        raise failure
    assert files_in(tmp_path) == []


def test_failure_half_way_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), written_whole(target) as stream:
        stream.write("new")
        raise RuntimeError("half way")
    assert target.read_text() == "old"
    assert files_in(tmp_path) == ["a.txt"]


def test_success_replaces_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("a much longer old text")
    with written_whole(target) as stream:
        stream.write("new")
    assert target.read_text() == "new"


def test_full_disk_is_an_input_error_and_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(InputError) as caught, written_whole(target):
        raise full
    assert str(caught.value) == f"cannot write {target}: No space left on device"
    assert caught.value.__cause__ is full
    assert files_in(tmp_path) == []


def test_missing_folder_is_named_with_the_way_out(tmp_path: Path) -> None:
    target = tmp_path / "nowhere" / "a.txt"
    with pytest.raises(InputError) as caught, written_whole(target):
        pytest.fail("the block must not run")
    assert str(caught.value) == (
        f"cannot write {target}: No such file or directory; give a path in a folder that exists "
        "and that you may write to"
    )


def test_closed_folder_is_named_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(tempfile, "mkstemp", refuse)  # root may write anywhere
    words = r"a\.txt: Permission denied; give a path in a folder"
    with pytest.raises(InputError, match=words), written_whole(tmp_path / "a.txt"):
        pytest.fail("the block must not run")


def test_folder_in_the_files_place_stays(tmp_path: Path) -> None:
    target = tmp_path / "a"
    (target / "inside").mkdir(parents=True)
    with pytest.raises(InputError, match="Is a directory"), written_whole(target) as stream:
        stream.write("x")
    assert files_in(tmp_path) == ["a"] and files_in(target) == ["inside"]


@pytest.mark.parametrize("size", [0, 1, 99, 100])
def test_file_up_to_the_limit_is_read_whole(tmp_path: Path, size: int) -> None:
    (tmp_path / "a").write_bytes(b"x" * size)
    assert read_bounded(tmp_path / "a", 100, InputError) == b"x" * size


def test_file_over_the_limit_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x" * 2_000_001)
    with pytest.raises(PlanFileError) as caught:
        read_bounded(path, 2_000_000, PlanFileError)
    assert str(caught.value) == f"{path} is larger than 2 MB, the most that is read"


@pytest.mark.parametrize("kind", [InputError, FootholdsError, PlanFileError])
def test_missing_file_is_the_callers_kind_of_error(
    tmp_path: Path, kind: type[GaitoptError]
) -> None:
    with pytest.raises(kind) as caught:
        read_bounded(tmp_path / "a", 100, kind)
    assert str(caught.value) == f"cannot read {tmp_path / 'a'}: No such file or directory"
    assert isinstance(caught.value.__cause__, FileNotFoundError)


def test_folder_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Is a directory"):
        read_bounded(tmp_path, 100, InputError)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes in folders are of POSIX")
def test_pipes_and_devices_are_refused_at_once(tmp_path: Path) -> None:
    """Reading a pipe waits for its writer, and a file in place of a device takes it away."""
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    with pytest.raises(FootholdsError, match="it is a pipe"):
        read_bounded(pipe, 10, FootholdsError)
    with pytest.raises(InputError, match="it is a device"):
        read_bounded("/dev/zero", 10, InputError)
    for special in (pipe, "/dev/null"):
        with pytest.raises(InputError, match="it is a "), written_whole(special) as stream:
            stream.write("x")
    assert stat.S_ISFIFO(pipe.stat().st_mode) and stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    with pytest.raises(GroundError, match="it is a pipe"):
        os.mkfifo(tmp_path / "pipe.mcap")
        gaitopt.load_ground(tmp_path / "pipe.mcap")


@pytest.mark.parametrize("path", [None, 3, b"a.txt", "a\0b", 1.5, ["a"]])
def test_what_is_no_path_is_an_input_error(path: object) -> None:
    with pytest.raises(InputError), written_whole(path) as stream:  # type: ignore[arg-type]
        stream.write("x")
    with pytest.raises(InputError):
        read_bounded(path, 10, InputError)  # type: ignore[arg-type]
