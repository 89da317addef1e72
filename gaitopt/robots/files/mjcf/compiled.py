"""MuJoCo's model of an MJCF."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gaitopt.errors import MissingPackageError, RobotError
from gaitopt.files import StrPath, read_bounded, silenced_stderr
from gaitopt.robots.files.meshes import MeshFinder
from gaitopt.robots.files.mjcf.text import MjcfText
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.xml_text import LIMIT


def model_of_file(path: StrPath) -> Any:
    """``mujoco.MjModel`` of a file, with only what describes the robot: no scene, no plugins.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        RobotError: the file cannot be read.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingPackageError(
            "reading an MJCF needs the package mujoco: pip install 'gaitopt[sim]'"
        ) from error
    text = read_bounded(path, LIMIT, RobotError).decode("utf-8", "replace")
    folder = Path(path).resolve().parent
    cleaned = MjcfText(text, Path(path).name, folder, MeshFinder(folder))
    return compiled(mujoco, cleaned, Path(path).name)


def compiled(mujoco: Any, cleaned: MjcfText, label: str) -> Any:
    """MuJoCo's model; raises RobotError where there is none."""
    words = ""
    for change in (None, cleaned.take_hulls, cleaned.take_corners):
        if change is not None:
            change()
        try:
            with silenced_stderr(), _without_log(mujoco):
                return mujoco.MjSpec.from_string(cleaned.text()).compile()
        except Exception as error:  # MuJoCo raises errors of several kinds
            words = words or " ".join(str(error).split())[:300]
    lost = f" (meshes that are missing: {first_of(cleaned.missing)})" if cleaned.missing else ""
    raise RobotError(f"{label}: MuJoCo cannot read this MJCF: {words}{lost}")


@contextmanager
def _without_log(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing its warnings into a file in the current folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
