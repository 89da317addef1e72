"""Reads a robot file of any kind that gaitopt knows: URDF, xacro and MJCF."""

from __future__ import annotations

import re
from pathlib import Path

from gaitopt.errors import InputError, RobotError
from gaitopt.files import read_bounded
from gaitopt.robots.files.notes import Notes, first_of
from gaitopt.robots.files.options import ReadOptions
from gaitopt.robots.files.prepare import prepared_urdf
from gaitopt.robots.files.xacro.expansion import expanded, is_xacro
from gaitopt.robots.xml_text import (
    LIMIT,
    outermost_tag,
    parsed_xml,
    refuse_entities,
    without_namespace,
)

_ENCODING = re.compile(rb"\s*<\?xml[^>]*encoding\s*=\s*[\"']([A-Za-z][\w.-]{0,30})[\"']")

_FIRST = re.compile(r"\A(?:\s|<!--(?:(?!-->).)*-->)+(?=<\?xml)", re.DOTALL)
"""What some files have before ``<?xml``, where nothing may be. A comment ends with its first
``-->``: else a file of many comments without ``<?xml`` would be cut into them in countless ways."""


def read_file(path: Path, options: ReadOptions) -> tuple[str, Notes]:
    """The URDF that a robot file makes, and what was read and guessed.

    Raises:
        RobotError: the file cannot be read, or is no robot that gaitopt can plan for.
        MissingPackageError: it is xacro or MJCF, and the package that reads these is missing.
        InputError: an option names what the robot does not have.
    """
    text = _decoded(read_bounded(path, LIMIT, RobotError), path)
    return read_text(text, name_of(path), options, path)


def _decoded(data: bytes, path: Path) -> str:
    """The text of a file: in UTF-8, or in the encoding that its first line declares.

    Raises:
        RobotError: it is in neither.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        declared = _ENCODING.match(data)
        names = [declared.group(1).decode("ascii")] if declared else []
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            names.append("utf-16")
        for name in names:
            try:
                text = data.decode(name)
            except (LookupError, UnicodeDecodeError):
                continue
            # Other readers are given the text in UTF-8.
            return re.sub(r"^\s*<\?xml[^>]*\?>", "", text)
        raise RobotError(f"{path} is no text in UTF-8 (byte {error.start}); a URDF is") from error


def name_of(path: Path) -> str:
    """A robot's name by its file: ``spot`` for ``spot.urdf.xacro``."""
    return path.stem.removesuffix(".urdf")


def read_text(
    text: str, label: str, options: ReadOptions, path: Path | None = None
) -> tuple[str, Notes]:
    """The URDF that the text of a robot file makes, and what was read and guessed.

    Args:
        text: of the file.
        label: what to call the robot in messages.
        options: what the user says of it.
        path: the file; ``None`` for a robot that comes as text.

    Raises:
        RobotError, MissingPackageError, InputError: as for :func:`read_file`; the text is empty;
            and there are arguments of xacro for a file that is no xacro.
    """
    folder, text = None if path is None else path.parent, _FIRST.sub("", text)
    if not text.strip():
        raise RobotError(f"{label}: the file is empty; give one that holds a robot")
    refuse_entities(text, label, "file")
    kind = outermost_tag(text)
    if kind.startswith("{"):
        text = without_namespace(text, label)
        kind = outermost_tag(text)
    if kind == "sdf":
        raise RobotError(
            f"{label}: this is SDF, which gaitopt does not read; convert it to a URDF, as the "
            "ROS package sdformat_urdf does"
        )
    xacro = kind == "robot" and is_xacro(parsed_xml(text, label, "URDF"))
    if options.xacro_arguments and not xacro:
        raise InputError(
            f"{label}: xacro_arguments: {first_of(list(options.xacro_arguments))} would change "
            "nothing, because this file is no xacro; leave them out, or give the xacro file"
        )
    if kind in ("mujoco", "mujocoinclude"):
        if options.scale is not None:
            raise InputError(f"{label}: scale is for URDF and xacro; an MJCF is in metres")
        from gaitopt.robots.files.mjcf.reader import read_mjcf

        return read_mjcf(text, label, folder, options)
    if xacro:
        plain, told = expanded(text, label, path, options)
        known = Notes(kind="xacro", warnings=tuple(told))
        return prepared_urdf(plain, known, label, folder, options)
    return prepared_urdf(text, None, label, folder, options)
