"""Robot files with random faults: what they may do is give a robot that makes sense, or an error.

``python tests/helpers/robot_faults.py --count 10000 [FILE ...]`` reads so many files with faults
and prints what came of them. Files given are mutated beside the small ones of the tests. Another
process reads them: where it dies, or takes longer than :data:`PATIENCE`, the file is told, and a
new process takes the next. The exit code is 1 when anything but a robot that makes sense or an
error of gaitopt came of a file.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import random
import re
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from robot_loading import feet_by_pinocchio
from robot_texts import CORNERS, mjcf, robot

import gaitopt
from gaitopt.certificate.certificate import Outcome
from gaitopt.conventions import LEGS
from gaitopt.errors import GaitoptError, RobotWarning
from gaitopt.planners.phase_by_phase.fitting_height import plan_touches

PATIENCE = 60.0
"""Longest time for one file [s]. Chosen: a hundred times what the slowest file here takes."""
WALKED = 20
"""One in so many robots that were read walks four steps, which are judged. Chosen: a walk takes ten
times as long as reading."""
TOLD = 500
"""After so many files the counts are told."""
UNEQUAL_FEET = "the feet have radii"
"""The warning of a robot on feet of different sizes: the larger ones come into the ground, as the
certificate tells."""
WORDS = (
    "1e200", "1e-200",
    "0", "-1", "1e308", "nan", "inf", "", "abc", "0 0 0", "1 2", "fixed", "floating", "continuous",
    "prismatic", "base", "LF_foot", "world", "mesh", "sphere", "-0", "1 0 0 0", "revolute", "ball",
)  # fmt: skip
BYTES = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"<", b">", b'"', b"&", b"&amp;", b"\xc3", b"<!--")
"""Bytes that files are broken with: no text, marks of encodings, half of an element."""


def motors() -> str:
    """Actuators with an inertia, gears and torques that fall with the speed, one a line."""
    import mujoco

    own = hasattr(mujoco.MjModel.from_xml_string("<mujoco/>"), "actuator_armature")
    armature = 'armature="0.001"' if own else ""
    return "\n".join(
        f'<general name="{n}_m{k}" joint="{n}_j{k}" gear="9" ctrlrange="-24 24" gainprm="0.5" '
        f'biastype="affine" biasprm="0 0 -0.08" forcerange="-8 8" {armature}/>'
        for n in CORNERS for k in range(3)
    )  # fmt: skip


def small_files() -> dict[str, str]:
    """Robot files to put faults into, by name: a URDF, and two MJCF."""
    return {
        "tester.urdf": robot().replace("><", ">\n<"),
        "tester.xml": mjcf(),
        "motors.xml": mjcf(actuators=motors()),
    }


def with_a_fault(text: str, rng: random.Random) -> str:
    """The text with an attribute, a tag or a line changed."""
    kind = rng.random()
    if kind < 0.5:
        values = list(re.finditer(r'="([^"]*)"', text))
        chosen = rng.choice(values)
        new = rng.choice(WORDS) if rng.random() < 0.7 else rng.choice(values).group(1)
        return text[: chosen.start(1)] + new + text[chosen.end(1) :]
    if kind < 0.75:
        pattern = r"<(\w+)" if rng.random() < 0.5 else r' (\w+)="'
        names = list(re.finditer(pattern, text))
        chosen = rng.choice(names)
        return text[: chosen.start(1)] + rng.choice(names).group(1) + text[chosen.end(1) :]
    lines = text.split("\n")
    at, count = rng.randrange(len(lines)), rng.choice((1, 1, 5, 30))
    if kind < 0.9:
        del lines[at : at + count]
    else:
        lines[at:at] = lines[at : at + count]
    return "\n".join(lines)


def with_broken_bytes(data: bytes, rng: random.Random) -> bytes:
    """The data with bytes put in, or cut off."""
    at = rng.randrange(len(data))
    if rng.random() < 0.2:
        return data[:at]
    return data[:at] + rng.choice(BYTES) + data[at + rng.choice((0, 1)) :]


def nonsense(made: gaitopt.Quadruped) -> str:
    """What makes no sense in a robot that was read, in words; empty where all does."""
    full, none = made.torque_lines
    low, high = made.position_limits[:, made.leg_joint_columns]
    legs = made.legs.values()
    numbers = [x for leg in legs
               for x in (*leg.hip, leg.upper, leg.lower, leg.lateral, leg.reach)]  # fmt: skip
    bodies = list(made.model.inertias)[1:]
    wrong = {
        "mass": not 0.0 < made.mass < np.inf,
        "radius of the feet": not 0.0 <= made.foot_radius < 1.0,
        "standing height": not 0.0 < made.standing_height < np.inf,
        "motors' inertia": not ((made.motor_inertia >= 0) & (made.motor_inertia <= 1000)).all(),
        "torque lines": not ((full >= 0) & ((full < none) | np.isinf(none))).all(),
        "position limits": not (low < high).all(),
        "velocity limits": not (made.velocity_limits[made.leg_joint_columns] > 0).all(),
        "torque limits": not (made.effort_limits[made.leg_joint_columns] >= 0).all(),
        "lengths": not np.isfinite(numbers).all(),
        "masses": not all(body.mass > 0 for body in bodies),
        "inertias": not all(np.linalg.eigvalsh(body.inertia)[0] > 0 for body in bodies),
    }
    return ", ".join(what for what, is_so in wrong.items() if is_so) or _wrong_feet(made)


def _wrong_feet(made: gaitopt.Quadruped) -> str:
    """Where the legs' kinematics and Pinocchio's differ at a posture within the limits."""
    low, high = (np.clip(limits, -3.0, 3.0) for limits in made.position_limits)
    joints = low + 0.3 * (high - low)
    ours = [made.legs[leg].forward(joints[list(made.leg_columns[leg])]) for leg in LEGS]
    error = float(np.abs(np.array(ours) - feet_by_pinocchio(made, joints)).max())
    return "" if error < 1e-8 else f"feet are off by {error:.3g} m"


def outcome(path: Path, walk: bool) -> tuple[str, str]:
    """What comes of a file: ``read``, ``refused``, ``walked``, ``no walk``; or a fault, told.

    ``warned``: the certificate refuses the walk of a robot whose feet a warning says to be unequal,
    or whose legs touch at every height, as the planner and ``gaitopt walk`` tell, too.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        try:
            made = gaitopt.load_robot(path)
        except GaitoptError as error:
            told = str(error)
            return ("refused", told) if told and "\n" not in told else ("FAULT", f"words: {told!r}")
    if wrong := nonsense(made):
        return "FAULT", f"read, with nonsense: {wrong}"
    if not walk:
        return "read", ""
    try:
        plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
        if gaitopt.verify(plan).outcome is Outcome.VIOLATED:
            warned = any(text.startswith(UNEQUAL_FEET) for text in made.notes.warnings)
            warned |= plan_touches(plan)
            told = "its walk does not keep what it promises"
            return ("warned" if warned else "FAULT"), told
    except GaitoptError as error:
        return "no walk", str(error)
    return "walked", ""


def faulty(number: int, texts: Sequence[tuple[str, str]]) -> tuple[str, bytes]:
    """The name and the bytes of the file with faults that has this number."""
    rng = random.Random(number)
    name, text = rng.choice(texts)
    for _ in range(rng.choice((1, 1, 1, 3))):
        text = with_a_fault(text, rng)
    data = text.encode("utf-8", "surrogatepass")
    return name, with_broken_bytes(data, rng) if data and rng.random() < 0.1 else data


def read_many(pipe: Connection, texts: Sequence[tuple[str, str]], folder: Path) -> None:
    """Read the files whose numbers come through the pipe, and send back what came of them."""
    while (number := pipe.recv()) is not None:
        name, data = faulty(number, texts)
        path = folder / name
        path.write_bytes(data)
        try:
            pipe.send(outcome(path, number % WALKED == 0))
        except Exception as error:
            pipe.send(("FAULT", f"{type(error).__name__}: {error}"))


class Reader:
    """A process that reads files, and another one when it dies or hangs."""

    def __init__(self, texts: Sequence[tuple[str, str]], folder: Path) -> None:
        self._given = texts, folder
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=read_many, args=(theirs, *self._given), daemon=True)
        self._process.start()
        theirs.close()

    def read(self, number: int) -> tuple[str, str]:
        """What comes of a file."""
        self._pipe.send(number)
        try:
            if self._pipe.poll(PATIENCE):
                return self._pipe.recv()
            told = f"no answer within {PATIENCE:g} s"
        except EOFError:
            told = "the process died"
        self._process.kill()
        self._process.join()
        self._start()
        return "FAULT", told


def main() -> int:
    """Read files with faults, and print what came of them."""
    parser = argparse.ArgumentParser(description="Reads robot files with random faults.")
    parser.add_argument("--count", type=int, default=1000, help="how many files")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("files", nargs="*", type=Path, help="robot files to mutate, too")
    given = parser.parse_args()
    texts = [*small_files().items(), *((f.name, f.read_text("utf-8")) for f in given.files)]
    folder, begin, faults = Path(tempfile.mkdtemp()), time.perf_counter(), 0
    counts: collections.Counter[str] = collections.Counter()
    reader = Reader(texts, folder)
    for number in range(given.first, given.first + given.count):
        kind, told = reader.read(number)
        counts[kind] += 1
        if kind == "FAULT":
            faults += 1
            print(f"file {number} ({faulty(number, texts)[0]}): {told}", flush=True)
        if counts.total() % TOLD == 0:
            print(f"{counts.total()} files: {_in_words(counts)}", file=sys.stderr, flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    seconds = time.perf_counter() - begin
    print(f"{given.count} files of {len(texts)} in {seconds:.0f} s: {_in_words(counts)}")
    return int(faults > 0)


def _in_words(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{kind} {count}" for kind, count in sorted(counts.items()))


if __name__ == "__main__":
    sys.exit(main())
