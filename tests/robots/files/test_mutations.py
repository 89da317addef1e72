"""Robot files with random faults: each is read, or refused by an error of gaitopt."""

from __future__ import annotations

import random
import re
import warnings

import mujoco
import numpy as np
import pytest
from robot_texts import CORNERS, mjcf, robot

from gaitopt.errors import GaitoptError, RobotWarning
from gaitopt.robots.catalog import load_robot

WORDS = (
    "1e200", "1e-200",
    "0", "-1", "1e308", "nan", "inf", "", "abc", "0 0 0", "1 2", "fixed", "floating", "continuous",
    "prismatic", "base", "LF_foot", "world", "mesh", "sphere", "-0", "1 0 0 0", "revolute", "ball",
)  # fmt: skip


def motors() -> str:
    """Actuators with an inertia, gears and torques that fall with the speed, one a line."""
    own = hasattr(mujoco.MjModel.from_xml_string("<mujoco/>"), "actuator_armature")
    armature = 'armature="0.001"' if own else ""
    return "\n".join(
        f'<general name="{n}_m{k}" joint="{n}_j{k}" gear="9" ctrlrange="-24 24" gainprm="0.5" '
        f'biastype="affine" biasprm="0 0 -0.08" forcerange="-8 8" {armature}/>'
        for n in CORNERS for k in range(3)
    )  # fmt: skip


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


@pytest.mark.parametrize("seed", range(4))
def test_faults_give_a_robot_that_makes_sense_or_a_typed_error(seed: int) -> None:
    rng = random.Random(seed)
    texts = (robot().replace("><", ">\n<"), mjcf(), mjcf(actuators=motors()))
    read = refused = 0
    for _ in range(60):
        text = rng.choice(texts)
        for _ in range(rng.choice((1, 1, 1, 3))):
            text = with_a_fault(text, rng)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RobotWarning)
                made = load_robot(text)
        except GaitoptError as error:
            assert str(error) and "\n" not in str(error)
            refused += 1
            continue
        read += 1
        assert 0.0 < made.mass < np.inf and 0.0 <= made.foot_radius < 1.0
        assert 0.0 < made.standing_height < np.inf
        assert (made.motor_inertia >= 0.0).all() and (made.motor_inertia <= 1000.0).all()
        full, none = made.torque_lines
        assert ((full >= 0.0) & ((full < none) | np.isinf(none))).all()
        for leg in made.legs.values():
            assert np.isfinite([*leg.hip, leg.upper, leg.lower, leg.lateral, leg.reach]).all()
        for inertia in list(made.model.inertias)[1:]:
            assert inertia.mass > 0.0 and np.linalg.eigvalsh(inertia.inertia)[0] > 0.0
    assert read > 3 and refused > 5
