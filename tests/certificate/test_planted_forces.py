"""Faults of robot and motion that forces do not allow: the certificate finds each of them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from shaken_paths import shaken

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.certificate import forces
from gaitopt.certificate.check import Verdict
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.forces import contact_forces
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.torque_limits import effort_limits

Edit = Callable[[ET.Element], None]
LIMITS = ForceLimits()


def changed(robot: Quadruped, edit: Edit) -> Quadruped:
    """The robot of an edited URDF."""
    root = ET.fromstring(robot.urdf)
    edit(root)
    return Quadruped.from_urdf(ET.tostring(root, encoding="unicode"), "changed", robot.knees)


def inertial(root: ET.Element, link: str) -> ET.Element:
    found = root.find(f"link[@name='{link}']/inertial")
    assert found is not None
    return found


def scaled(factor: float, link: str) -> Edit:
    """The mass of a link, with its inertia, times ``factor``."""

    def edit(root: ET.Element) -> None:
        for part in ("mass", "inertia"):
            element = inertial(root, link).find(part)
            assert element is not None
            for key, value in element.attrib.items():
                element.set(key, str(factor * float(value)))

    return edit


def moved(robot: Quadruped, link: str, by: tuple[float, float, float]) -> Quadruped:
    """The robot with its centre of mass moved, by moving that of one link."""

    def edit(root: ET.Element) -> None:
        at, mass = inertial(root, link).find("origin"), inertial(root, link).find("mass")
        assert at is not None and mass is not None
        lever = robot.mass / float(mass.get("value", ""))
        place = np.array(at.get("xyz", "").split(), dtype=float) + lever * np.array(by)
        at.set("xyz", " ".join(map(str, place)))

    return changed(robot, edit)


def test_the_robot_itself_passes(a1_walk: Plan) -> None:
    again = changed(a1_walk.robot, scaled(1.0, "trunk"))
    certificate = gaitopt.verify(replace(a1_walk, robot=again), collisions=False)
    assert certificate.ok and certificate["contact forces"].status is Verdict.OK


@pytest.mark.parametrize("by", [(5e-3, 0.0), (-5e-3, 0.0), (0.0, 5e-3), (0.0, -5e-3)])
def test_a_centre_of_mass_that_is_five_millimetres_off_is_found(
    a1_walk: Plan, by: tuple[float, float]
) -> None:
    other = moved(a1_walk.robot, "trunk", (*by, 0.0))
    check = gaitopt.verify(replace(a1_walk, robot=other), collisions=False)["contact forces"]
    assert check.status is Verdict.VIOLATED and check.promised and check.worst < -1.0


@pytest.mark.parametrize("feet", [(), ("LF",), ("LF", "RH")])
def test_too_few_feet_are_found(a1_walk: Plan, feet: tuple[str, ...]) -> None:
    """No foot makes no force, and one or two make no moment about a point or a line."""
    phases = list(a1_walk.phases)
    phases[0] = replace(phases[0], support=feet)
    check = contact_forces(replace(a1_walk, phases=tuple(phases)), LIMITS)
    assert check.status is Verdict.VIOLATED and check.where.startswith("a wrench")


def test_once_a_sample_has_no_forces_nothing_is_cut_further(
    a1_walk: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With four feet that stand all the time, most pieces are wrong by far; 300 000 were judged."""
    judge, counts = forces._judge_pieces, []

    def counting(plan: Plan, limits: ForceLimits, pieces: Pieces) -> forces._Judged:
        counts.append(len(pieces.starts))
        return judge(plan, limits, pieces)

    monkeypatch.setattr(forces, "_judge_pieces", counting)
    assert contact_forces(replace(a1_walk, phases=()), LIMITS).status is Verdict.VIOLATED
    assert len(counts) == 1 and counts[0] < 2000


def test_a_heavier_payload_is_found(a1_walk: Plan) -> None:
    heavy = changed(a1_walk.robot, scaled(2.0, "trunk"))
    check = contact_forces(replace(a1_walk, robot=heavy), LIMITS)
    assert check.status is Verdict.VIOLATED


def test_limbs_whose_masses_were_a_hundredth_are_found(a1_walk: Plan) -> None:
    """Planned with light limbs, the walk is faster, and no forces make it with the true ones."""

    def edit(root: ET.Element) -> None:
        for leg in ("FR", "FL", "RR", "RL"):
            for part in ("hip", "thigh", "calf"):
                scaled(0.01, f"{leg}_{part}")(root)

    light = changed(a1_walk.robot, edit)
    fast = gaitopt.plan_crawl(light, a1_walk.footholds)
    assert fast.duration < 0.8 * a1_walk.duration
    assert contact_forces(fast, LIMITS).status is Verdict.OK
    check = contact_forces(replace(fast, robot=a1_walk.robot), LIMITS)
    assert check.status is Verdict.VIOLATED
    # Nor does the true robot's walk do for the light one.
    assert contact_forces(replace(a1_walk, robot=light), LIMITS).status is Verdict.VIOLATED


def test_a_foot_that_would_have_to_pull_is_found(wang: Quadruped) -> None:
    """Without a margin the true centre of mass leaves its support by a few millimetres."""
    edge = gaitopt.plan_crawl(
        wang, gaitopt.s_columns(1, columns=2), objective="time", free="route",
        stability_margin=0.0, acceleration_limit=0.5, timing="velocity", com="body",
    )  # fmt: skip
    limits = ForceLimits(friction=1.0, reserve=0.0, torque_share=1.0)
    check = contact_forces(edge, limits)
    assert check.status is Verdict.VIOLATED
    assert check.where.startswith(("normal force", "friction")) and check.worst < -0.1
    found = gaitopt.contact_forces(edge, limits=limits, times=[check.when])
    assert found.forces[0, :, 2].min() < 0.0


@pytest.mark.parametrize(("share", "good"), [(0.985, True), (1.01, False)])
def test_one_per_cent_too_much_torque_for_five_milliseconds_is_found(
    slow: Plan, share: float, good: bool
) -> None:
    """The hip of a flying foot shakes between two samples, and its motor is a bit too weak.

    The legs that stand could share their loads in other ways, a leg that flies could not.
    """
    robot, swing, length = slow.robot, slow.swings[1], 5e-3
    column = robot.leg_columns[swing.leg][0]
    start = swing.start + 0.3 * swing.duration
    path = shaken(slow.path, start, length, 6 + column, 1e-4)
    plan = replace(slow, path=path)
    found = gaitopt.contact_forces(plan, times=np.linspace(start, start + length, 201))
    usual = gaitopt.contact_forces(slow, dt=0.1).torques[:, column]
    peak = np.abs(found.torques[:, column]).max()
    assert peak > 1.5 * np.abs(usual).max()
    name, limit = robot.joint_names[column], peak / share / LIMITS.torque_share

    def edit(root: ET.Element) -> None:
        element = root.find(f"joint[@name='{name}']/limit")
        assert element is not None
        element.set("effort", str(limit))

    weak = changed(robot, edit)
    assert effort_limits(weak).limits[column] == pytest.approx(limit)
    check = contact_forces(replace(plan, robot=weak), LIMITS)
    assert (check.status is Verdict.OK) is good, check
    if not good:
        assert start <= check.when <= start + length and check.where.startswith(f"torque {name}")


def test_a_model_that_was_changed_in_memory_is_judged_by_its_file() -> None:
    robot = Quadruped.from_urdf(gaitopt.load_robot("a1").urdf, "a1")
    for limits in (robot.model.effortLimit, robot.model.velocityLimit):
        limits[6:] *= 10.0
    for inertia in robot.model.inertias:
        inertia.mass *= 0.1
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    certificate = gaitopt.verify(plan, collisions=False)
    assert "contact forces" in {check.name for check in certificate.violations}
    fresh = replace(plan, robot=gaitopt.load_robot("a1"))
    assert certificate.report() == gaitopt.verify(fresh, collisions=False).report()


@pytest.mark.parametrize("name", ["go2", "anymal_c", "hyq"])
def test_they_are_found_on_other_robots(name: str) -> None:
    """A centre of mass that is 5 mm off, light limbs, and 1 % less friction than the walk needs."""
    robot = gaitopt.load_robot(name)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    assert contact_forces(plan, LIMITS).status is Verdict.OK
    links = [e.get("name", "") for e in ET.fromstring(robot.urdf).findall("link")
             if e.find("inertial/mass") is not None]  # fmt: skip
    trunk = max(links, key=lambda link: mass_of(robot, link))

    def lighten(root: ET.Element) -> None:
        for link in links:
            if link != trunk:
                scaled(0.01, link)(root)

    other = [moved(robot, trunk, by) for by in ((5e-3, 0.0, 0.0), (0.0, -5e-3, 0.0))]
    for wrong in (*other, changed(robot, lighten)):
        assert contact_forces(replace(plan, robot=wrong), LIMITS).status is Verdict.VIOLATED
    friction, exist = LIMITS.friction, True
    while exist:
        friction *= 0.99
        limits = ForceLimits(friction=friction)
        exist = gaitopt.contact_forces(plan, limits, dt=0.005).feasible_share == 1.0
    assert friction > 0.9 * LIMITS.friction
    assert contact_forces(plan, limits).status is Verdict.VIOLATED


def mass_of(robot: Quadruped, link: str) -> float:
    mass = inertial(ET.fromstring(robot.urdf), link).find("mass")
    assert mass is not None
    return float(mass.get("value", ""))
