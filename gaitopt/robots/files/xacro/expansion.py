"""xacro, the macro language in which ROS packages keep URDFs, through the package xacrodoc."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

from gaitopt.errors import MissingPackageError, RobotError
from gaitopt.files import read_bounded
from gaitopt.robots.files.meshes import LEVELS, with_ros_packages
from gaitopt.robots.files.options import ReadOptions
from gaitopt.robots.files.xacro.process import MOST_SECONDS

_ELEMENT = re.compile(r"\{[^}]*\bxacro\b[^}]*\}")
"""Begins an element's name that is in the namespace of xacro."""
_FIND = re.compile(r"\$\(\s*find\s+([\w.-]+)\s*\)([\w./-]*)")
_HERE = re.compile(r"\$\(\s*cwd\s*\)([\w./-]*)")
_UNDEFINED = re.compile(r"Undefined substitution argument (\w+)")
_UNSET = re.compile(r"environment variable '(\w+)' is not set")
ROS_VARIABLES = {"ROS_VERSION": "2"}
"""Variables of the environment that files ask for, and what they are where nobody has set them.
Files choose their drivers and simulators by them, which say nothing of what is read here."""
MOST_GUESSED = 10
"""Most arguments that are taken as false."""
MOST_FILES = 300
"""Most xacro files whose packages are looked for."""
FILE_LIMIT = 5_000_000
"""Most bytes of one of them."""


def is_xacro(root: ElementTree.Element) -> bool:
    """Whether a file has elements or expressions of xacro; some URDFs only declare a namespace."""
    return any(
        _ELEMENT.match(str(element.tag)) or any("${" in value for value in element.attrib.values())
        for element in root.iter()
    )


def expanded(
    text: str, label: str, path: Path | None, options: ReadOptions
) -> tuple[str, list[str]]:
    """The URDF that a xacro file stands for, and warnings.

    Args:
        text: of the file.
        label: what to call the robot in messages.
        path: the file; ``None`` for a text without one.
        options: values of its arguments, and folders of packages.

    Raises:
        MissingPackageError: xacrodoc is not installed.
        RobotError: xacro cannot expand the file; the message holds xacro's.
    """
    if importlib.util.find_spec("xacrodoc") is None:
        raise MissingPackageError(
            f"{label} is xacro and no URDF; reading it needs the package xacrodoc: "
            "pip install 'gaitopt[xacro]'"
        )
    with tempfile.TemporaryDirectory() as name:
        staging = Path(name)
        if path is None:
            path = staging / "robot.xacro"
            path.write_text(text, "utf-8")
        whole = path.resolve()
        packages = _packages(whole, options, staging / "packages")
        return _with_arguments(whole, label, options, packages, staging)


def _with_arguments(
    path: Path, label: str, options: ReadOptions, packages: Mapping[str, str], staging: Path
) -> tuple[str, list[str]]:
    """Expand a file; a switch without a value is taken as false.

    Files are often expanded by scripts that give such a value (``DEBUG:=false``).
    """
    arguments = {name: str(value) for name, value in options.xacro_arguments.items()}
    guessed: list[str] = []
    job = {"path": str(path), "arguments": arguments, "packages": packages}
    while True:
        done = _run(job, path, label)
        if done.returncode == 0 and done.stdout:
            warnings = [f"xacro arguments without a value were taken as false: "
                        f"{', '.join(guessed)}; give xacro_arguments="]  # fmt: skip
            return done.stdout, warnings if guessed else []
        missing = _UNDEFINED.search(done.stderr)
        if missing is None or len(guessed) >= MOST_GUESSED or missing.group(1) in arguments:
            break
        arguments[missing.group(1)] = "false"
        guessed.append(missing.group(1))
    told = done.stderr.replace(f"{staging}/packages", "(beside the file)")
    words = " ".join(told.split())[-400:] or f"it ended with {done.returncode}"
    unset = _UNSET.search(words)
    if unset is not None:
        words += f"; set it, as with {unset.group(1)}=... before the command"
    lost = [name for name, folder in packages.items() if Path(folder).is_relative_to(staging)]
    if lost:
        words += f"; packages that are nowhere: {', '.join(lost)}"
    folders = ", ".join(str(folder) for folder in options.package_folders) or "none"
    raise RobotError(
        f"{label}: xacro cannot expand this file: {words} (arguments: {arguments}; package "
        f"folders: {folders}; give xacro_arguments={{...}} or package_folders=[...])"
    )


def _run(job: Mapping[str, object], path: Path, label: str) -> subprocess.CompletedProcess[str]:
    """Expand a file in another process."""
    script = str(Path(__file__).with_name("process.py"))
    environment = {**ROS_VARIABLES, **os.environ}
    try:
        return subprocess.run(
            [sys.executable, script], input=json.dumps(job), capture_output=True, text=True,
            timeout=2 * MOST_SECONDS, check=False, cwd=_working_folder(path), env=environment,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RobotError(f"{label}: expanding this xacro file did not end: {error}") from error


def _working_folder(path: Path) -> Path:
    """Where a file is expanded: ``$(cwd)`` in it is this folder.

    Its author may have stood above it: the nearest folder counts in which all files are that it
    names so, or else its own.
    """
    try:
        text = read_bounded(path, FILE_LIMIT, RobotError).decode("utf-8", "replace")
    except RobotError:
        return path.parent
    named = [inside.lstrip("/") for inside in _HERE.findall(text)]
    above = list(path.parents)[:LEVELS]
    found = (f for f in above if named and all((f / name).is_file() for name in named))
    return next(found, path.parent)


def _packages(path: Path, options: ReadOptions, staging: Path) -> dict[str, str]:
    """Folders of the packages that a xacro file and those beside it name.

    A package that is nowhere is made of the files that lie beside the xacro file and have the names
    that are looked for in it: people copy files out of their packages.
    """
    found, wanted = {}, _wanted(path)
    for package, files in wanted.items():
        folder = next(_folders(package, path, options), None)
        if folder is None:
            folder = staging / package
            for inside in files:
                near = path.parent / Path(inside).name
                target = folder / inside.lstrip("/")
                if near.is_file() and target.resolve().is_relative_to(folder.resolve()):
                    target.parent.mkdir(parents=True, exist_ok=True)
                    if not target.exists():
                        target.symlink_to(near)
            if not folder.is_dir():
                continue
        found[package] = str(folder)
    return found


def _wanted(path: Path) -> dict[str, set[str]]:
    """The packages that xacro files in a folder name with ``$(find ...)``, and files in them."""
    wanted: dict[str, set[str]] = {}
    files = [path, *sorted(p for p in path.parent.rglob("*.xacro") if p != path)[:MOST_FILES]]
    for file in files:
        try:
            text = read_bounded(file, FILE_LIMIT, RobotError).decode("utf-8", "replace")
        except RobotError:
            continue
        for package, inside in _FIND.findall(text):
            wanted.setdefault(package, set()).add(inside)
    return wanted


def _folders(package: str, path: Path, options: ReadOptions) -> Iterator[Path]:
    """Where a package may be, the likeliest place first."""
    for folder in with_ros_packages(options.package_folders):
        if folder.name == package and folder.is_dir():
            yield folder.resolve()
        if (folder / package).is_dir():
            yield (folder / package).resolve()
    for folder in list(path.parents)[:LEVELS]:
        if folder.name == package or _package_name(folder) == package:
            yield folder
        if (folder / package).is_dir():
            yield folder / package


def _package_name(folder: Path) -> str:
    """The name in a folder's ``package.xml``; empty without one."""
    try:
        data = read_bounded(folder / "package.xml", FILE_LIMIT, RobotError)
    except RobotError:
        return ""
    text = data.decode("utf-8", "replace")
    name = re.search(r"<name>\s*([\w.-]+)\s*</name>", text)
    return name.group(1) if name else ""
