"""Robot files with faults: loaded, planned for, judged, walked in physics and drawn.

Faults come into URDFs of several robots, a xacro and what it includes, an MJCF, and meshes (STL,
OBJ, DAE): :mod:`benchmarks.fuzz.robot_files`.
"""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path
from typing import Any, Final

import numpy as np

import gaitopt
from benchmarks.fuzz.calls import folder
from benchmarks.fuzz.mutations import damaged, mutated
from benchmarks.fuzz.outcome import HALF, REFUSED, Outcome, outcome
from benchmarks.fuzz.robot_files import Source, sources
from gaitopt.certificate.certificate import Outcome as Verdict

CASES = 200_000
"""Of so many a run takes those that its seed chooses."""
FARTHEST = 1e4
"""Places of feet of a robot that is taken lie within this [m]."""
MESHES = (".stl", ".obj", ".dae")
PLANS_QUICKLY, PLANS_WITH_FORCES = 4, 16
"""One in so many robots that were taken walks; one in so many with contact forces, and in physics.
Chosen: such a walk takes ten times as long as reading."""
SAID_BEFORE: Final = ("the feet have radii", "the feet of ", "the end of leg", "joints that rub",
                      "motors that have about")  # fmt: skip
"""How warnings begin of robots whose walks the certificate or physics may refuse."""
WORDS: Final = (
    "1e200", "1e-200", "0", "-1", "1e308", "nan", "inf", "", "abc", "0 0 0", "1 2", "fixed",
    "floating", "continuous", "prismatic", "base", "lf_shank", "world", "mesh", "sphere", "-0",
    "1 0 0 0", "revolute", "ball",
)  # fmt: skip
"""What stands in place of an attribute."""
BYTES: Final = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"<", b">", b'"', b"&", b"&amp;", b"\xc3",
                b"<!--")  # fmt: skip
"""Bytes that files are broken with: no text, marks of encodings, half of an element."""


def cases() -> list[int]:
    """Seeds of the faults."""
    return list(range(CASES))


def with_faults(case: int) -> tuple[Source, str, bytes]:
    """A robot, the name of the file of it that has faults, and that file."""
    chance = random.Random(case)
    source = chance.choice(sources())
    name = chance.choice(sorted(source.files))
    data = source.files[name]
    if name.endswith(MESHES) and chance.random() < 0.7:
        return source, name, damaged(data, case)
    if name.endswith(MESHES):
        return source, name, mutated(data.decode("latin-1"), case).encode("latin-1", "replace")
    text = data.decode("utf-8")
    if chance.random() < 0.4:
        text = mutated(text, case)
    else:
        for _ in range(chance.choice((1, 1, 1, 3))):
            text = with_a_fault(text, chance)
    data = text.encode("utf-8", "surrogatepass")
    return source, name, with_broken_bytes(data, chance) if chance.random() < 0.1 else data


def with_a_fault(text: str, chance: random.Random) -> str:
    """An XML text with an attribute, a tag or a line changed."""
    kind = chance.random()
    values = list(re.finditer(r'="([^"]*)"', text))
    if kind < 0.5 and values:
        chosen = chance.choice(values)
        new = chance.choice(WORDS) if chance.random() < 0.7 else chance.choice(values).group(1)
        return text[: chosen.start(1)] + new + text[chosen.end(1) :]
    names = list(re.finditer(r"<(\w+)" if chance.random() < 0.5 else r' (\w+)="', text))
    if kind < 0.75 and names:
        chosen = chance.choice(names)
        return text[: chosen.start(1)] + chance.choice(names).group(1) + text[chosen.end(1) :]
    lines = text.split("\n")
    at, count = chance.randrange(len(lines)), chance.choice((1, 1, 5, 30))
    if kind < 0.9:
        del lines[at : at + count]
    else:
        lines[at:at] = lines[at : at + count]
    return "\n".join(lines)


def with_broken_bytes(data: bytes, chance: random.Random) -> bytes:
    """The data with bytes put in, or cut off."""
    at = chance.randrange(max(len(data), 1))
    if chance.random() < 0.2:
        return data[:at]
    return data[:at] + chance.choice(BYTES) + data[at + chance.choice((0, 1)) :]


def run(case: int) -> Outcome:
    """Load a robot with faults, walk two steps of columns, and write the replay."""
    source, name, data = with_faults(case)
    here = folder() / "robot"
    shutil.rmtree(here, ignore_errors=True)
    here.mkdir()
    for other, content in source.files.items():
        (here / other).write_bytes(data if other == name else content)
    before = set(folder().iterdir())
    found = outcome(lambda: _walk(here / source.main, source, case), nonsense)
    after = set(folder().iterdir()) - before
    for made in after:
        made.unlink()
    if found.kind == REFUSED and after:
        return Outcome(HALF, ", ".join(made.name for made in after))
    return found._replace(words=f"{source.main}, {name}: {found.words}") if found.words else found


def _walk(path: Path, source: Source, case: int) -> tuple[Any, str]:
    """The robot, and what is wrong with its walk, in words."""
    folders = [folder for folder in source.folders if folder.is_dir()]
    robot = gaitopt.load_robot(path, package_folders=folders)
    if case % PLANS_QUICKLY:
        return robot, ""
    forces = case % PLANS_WITH_FORCES == 0
    columns = gaitopt.s_columns(0, columns=2, robot=robot)
    plan = gaitopt.plan_crawl(robot, columns, timing="forces" if forces else "velocity")
    certificate = gaitopt.verify(plan, collisions=forces)
    gaitopt.replay(plan, folder() / "robot.html", meshes=path.parent if case % 8 == 0 else False)
    if not 0.0 < plan.duration < 1e7:
        return robot, f"a walk of {plan.duration} s"
    told = any(text.startswith(SAID_BEFORE) for text in robot.notes.warnings)
    if forces and certificate.outcome is Verdict.VIOLATED and not (told or _touches(plan)):
        return robot, "its walk does not keep what it promises"
    if forces:
        gaitopt.simulate(plan)
    return robot, ""


def _touches(plan: gaitopt.Plan) -> bool:
    """Whether the planner tells that the legs touch at every height."""
    from gaitopt.planners.phase_by_phase.fitting_height import plan_touches

    return bool(plan_touches(plan))


def nonsense(result: tuple[Any, str]) -> str:
    """What makes no sense in a robot that was read, or in its walk; empty where all does."""
    made, wrong_walk = result
    full, none = made.torque_lines
    low, high = made.position_limits[:, made.leg_joint_columns]
    legs = made.legs.values()
    numbers = np.array([x for leg in legs
               for x in (*leg.hip, leg.upper, leg.lower, leg.lateral, leg.reach)])  # fmt: skip
    bodies = list(made.model.inertias)[1:]
    wrong = {
        "mass": not 0.0 < made.mass < 1e6,
        "radius of the feet": not 0.0 <= made.foot_radius < 1.0,
        "standing height": not 0.0 < made.standing_height < np.inf,
        "motors' inertia": not ((made.motor_inertia >= 0) & (made.motor_inertia <= 1000)).all(),
        "torque lines": not ((full >= 0) & ((full < none) | np.isinf(none))).all(),
        "position limits": not (low < high).all(),
        "velocity limits": not (made.velocity_limits[made.leg_joint_columns] > 0).all(),
        "torque limits": not (made.effort_limits[made.leg_joint_columns] >= 0).all(),
        "lengths": not (np.isfinite(numbers).all() and np.abs(numbers).max() < FARTHEST),
        "masses": not all(body.mass > 0 for body in bodies),
        "inertias": not all(np.linalg.eigvalsh(body.inertia)[0] > 0 for body in bodies),
    }
    found = ", ".join(what for what, is_so in wrong.items() if is_so)
    return found or _wrong_feet(made) or wrong_walk


def _wrong_feet(made: gaitopt.Quadruped) -> str:
    """Where the legs' kinematics and Pinocchio's differ at a posture within the limits."""
    import pinocchio as pin

    low, high = (np.clip(limits, -3.0, 3.0) for limits in made.position_limits)
    joints = low + 0.3 * (high - low)
    data, q = made.model.createData(), pin.neutral(made.model)
    q[7:] = joints
    pin.framesForwardKinematics(made.model, data, q)
    error = 0.0
    for leg in gaitopt.LEGS:
        ours = made.legs[leg].forward(joints[list(made.leg_columns[leg])])
        frame = data.oMf[made.model.getFrameId(made.legs[leg].foot)]
        theirs = made.body_axes.T @ frame.translation
        error = max(error, float(np.abs(ours - theirs).max()))
    return "" if error < 1e-8 else f"feet are off by {error:.3g} m"
