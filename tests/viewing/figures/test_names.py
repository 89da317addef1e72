"""Names from files in figures: in one line, and never read as a formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import matplotlib.text
import numpy as np
import pytest

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.studies.study_report import plot_study
from gaitopt.viewing.figures.common import plain
from gaitopt.viewing.figures.race import plot_race

BAD = "a $x^{2$ \x1b[31m\nb"
"""A formula that is not well formed, a colour for terminals, and the end of a line."""


@pytest.fixture(scope="module")
def plan() -> Plan:
    own = gaitopt.load_robot("wang2020")
    urdf = own.urdf.replace('"LF_HAA"', '"LF_$x^{2$_HAA"')
    robot = Quadruped.from_urdf(urdf, "robot $x^{2$", dict(own.knees))
    columns = gaitopt.s_columns(0, columns=2, robot=own)
    return gaitopt.plan_crawl(robot, columns, timing="velocity")


def texts(drawn: Any) -> list[str]:
    """All texts of a figure, which is drawn."""
    figure = np.ravel(np.asarray(drawn, dtype=object))[0].figure
    figure.canvas.draw()
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


def test_a_plain_name_is_one_line_and_no_formula() -> None:
    assert plain(BAD) == r"a \$x^{2\$ \x1b[31m\nb"


@pytest.mark.parametrize(
    "draw",
    [
        gaitopt.plot_paths,
        gaitopt.plot_joint_velocities,
        gaitopt.plot_snapshots,
        gaitopt.plot_zmp,
        lambda plan: gaitopt.plot_cog_over_time({BAD: plan}),
        lambda plan: gaitopt.plot_gait_diagram(replace(gaitopt.trot(0.5), name=BAD)),
        lambda plan: plot_race({BAD: 1.0, "other": 2.0}, baseline=BAD),
    ],
)
def test_figures_are_drawn_with_names_that_look_like_formulas(
    draw: Callable[[Plan], Any], plan: Plan
) -> None:
    assert any("x^{2" in text for text in texts(draw(plan)))


def test_the_picture_of_a_study_is_drawn_with_such_names() -> None:
    row = dict.fromkeys(("robot", "objective", "speed", "stability_margin", "body_height"), BAD)
    row |= {"status": "ok", "duration": "1", "com_margin": "0.1", "message": "", "seed": "0"}
    assert any("x^{2" in text for text in texts(plot_study([row])))
