"""Footholds with little friction in physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, HeightMap, Plan, SimulationSettings
from gaitopt.simulation.grip import Grip
from gaitopt.simulation.model import SimModel, build_sim_model, to_mujoco

mujoco = pytest.importorskip("mujoco")


def with_friction(plan: Plan, first: float, map_of: bool = False) -> Plan:
    """The plan with this friction where LF stands at first, and 0.6 elsewhere."""
    friction = {leg: np.full(n, 0.6) for leg, n in plan.footholds.counts.items()}
    friction["LF"][0] = first
    holds = plan.footholds.with_(friction=friction)
    if map_of:
        low = float(holds.array[..., 2].min()) - plan.robot.foot_radius
        holds = holds.with_(
            radius=None, ground=HeightMap(np.full((80, 60), low), 0.05, (-2.0, -1.5))
        )
    return replace(plan, footholds=holds)


def model(plan: Plan, settings: SimulationSettings) -> SimModel:
    return build_sim_model(plan.robot, plan.footholds, settings)


@pytest.mark.parametrize("map_of", [False, True])
def test_contacts_have_the_friction_of_their_footholds(a1_walk: Plan, map_of: bool) -> None:
    """Half of the friction of the limits is half of the friction of the settings."""
    plan, settings = with_friction(a1_walk, 0.3, map_of), SimulationSettings(friction=0.9)
    sim = model(plan, settings)
    Grip(sim, plan, settings).stand_on(0.0)
    data = mujoco.MjData(sim.model)
    q = np.array(plan.at([0.0]).q[0])
    q[2] -= 1e-4
    data.qpos[:] = to_mujoco(sim, q)
    mujoco.mj_forward(sim.model, data)
    found: dict[str, set[float]] = {leg: set() for leg in LEGS}
    for contact in range(data.ncon):
        for geom in data.contact.geom[contact].tolist():
            if geom in sim.feet:
                leg = LEGS[sim.feet.index(geom)]
                found[leg].add(round(float(data.contact.friction[contact][0]), 9))
    assert found["LF"] == {0.45}
    assert all(found[leg] == {0.9} for leg in LEGS if leg != "LF")


def test_friction_changes_as_feet_step_on(a1_walk: Plan) -> None:
    plan, settings = with_friction(a1_walk, 0.06), SimulationSettings()
    sim = model(plan, settings)
    grip, ball = Grip(sim, plan, settings), sim.feet[LEGS.index("LF")]
    swing = next(s for s in plan.swings if s.leg == "LF")
    seen = []
    for clock in (0.0, swing.start, swing.end):
        grip.stand_on(clock)
        seen.append(float(sim.model.geom_friction[ball, 0]))
    assert seen == pytest.approx([0.1, 0.1, 1.0])


def test_ground_with_all_the_friction_of_the_limits_is_as_without(a1_walk: Plan) -> None:
    plan, settings = with_friction(a1_walk, 0.6), SimulationSettings()
    ours, bare = model(plan, settings), model(a1_walk, settings)
    Grip(ours, plan, settings).stand_on(0.0)
    for name in ("geom_friction", "geom_priority", "geom_solimp"):
        assert np.array_equal(getattr(ours.model, name), getattr(bare.model, name))


def test_a_foot_on_ice_slips(a1_walk: Plan) -> None:
    """It slips although the controller knows of the ice: the leg in motion pushes it."""
    firm, ice = gaitopt.simulate(a1_walk), gaitopt.simulate(with_friction(a1_walk, 0.006))
    assert firm.passed
    assert ice.slip > 1.5 * firm.slip
