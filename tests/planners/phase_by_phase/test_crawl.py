"""The planned walk, judged by Pinocchio, by symmetry and by independent sums."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

import gaitopt
from gaitopt import LEGS, Footholds, InfeasibleStepError, InputError, Plan, Quadruped, plan_crawl
from gaitopt.optimize.speed import arc_speed, foot_rates
from gaitopt.terrain.columns import s_columns

Array = NDArray[np.float64]
LIMIT = np.radians(17.0)


def feet_by_pinocchio(robot: Quadruped, q: Array) -> Array:
    """Foot frames ``(N, 4, 3)`` in the world."""
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    out = np.empty((len(q), 4, 3))
    for row, configuration in zip(out, q, strict=True):
        pin.framesForwardKinematics(model, data, configuration)
        for i, frame in enumerate(frames):
            row[i] = data.oMf[frame].translation
    return out


def flat_footholds(robot: Quadruped, count: int, stride: float) -> Footholds:
    """Feet straight below the hips, carried forward in equal steps."""
    length, width = robot.stance_size
    corners = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}
    return Footholds(
        {
            leg: [[sx * length / 2 + k * stride, sy * width / 2, 0.0] for k in range(count)]
            for leg, (sx, sy) in corners.items()
        }
    )


def test_the_main_job_takes_what_an_independent_calculation_says(plan: Plan) -> None:
    """[Wang2020], Table II reports 205 s; an independent calculation gave 212 to 236 s."""
    assert 212.0 < plan.duration < 236.0
    assert len(plan.phases) == 128
    assert plan.mean_speed == pytest.approx(plan.distance / plan.duration)


def test_standing_feet_do_not_move(plan: Plan) -> None:
    """Less than 0.1 mm at any sampled instant, by Pinocchio's forward kinematics."""
    motion = plan.at(np.sort(np.random.default_rng(0).uniform(0, plan.duration, 6000)))
    feet = feet_by_pinocchio(plan.robot, motion.q)
    assert feet == pytest.approx(motion.feet, abs=1e-9)
    current = {leg: 0 for leg in LEGS}
    worst = 0.0
    for phase in plan.phases:
        inside = (motion.t >= phase.start) & (motion.t < phase.end)
        for leg in phase.support:
            gaps = feet[inside, LEGS.index(leg)] - plan.footholds[leg][current[leg]]
            worst = max(worst, float(np.abs(gaps).max(initial=0.0)))
        if phase.kind == "swing":
            current[phase.leg] += 1
    assert worst < 1e-4
    assert worst < 2e-5  # what SLIP_TOLERANCE promises


def test_every_foot_lands_on_each_of_its_footholds(plan: Plan) -> None:
    for phase in plan.phases:
        if phase.kind == "swing":
            landed = plan.at([phase.end]).feet[0, LEGS.index(phase.leg)]
            k = phase.step // 4 + 1
            assert landed == pytest.approx(plan.footholds[phase.leg][k], abs=1e-9)
            assert phase.foot_end == pytest.approx(landed, abs=1e-9)


def test_joint_velocities_keep_their_limit_and_use_it(plan: Plan) -> None:
    rates = np.abs(plan.path.coefficients[0][:, 6:])
    assert rates.max() <= LIMIT * (1 + 1e-12)
    assert rates.max(axis=1).min() >= LIMIT * (1 - 1e-9)


def test_the_cog_stays_within_the_shrunken_triangle_while_a_foot_flies(plan: Plan) -> None:
    for phase in plan.phases:
        if phase.kind == "swing":
            feet = [plan.at([phase.start]).feet[0, LEGS.index(leg)] for leg in phase.support]
            margin = gaitopt.static_stability_margin(np.array(feet), phase.cog_start)
            assert margin >= 0.02 - 1e-9
            assert phase.margin == pytest.approx(float(margin), abs=1e-9)
            assert (phase.cog_start == phase.cog_end).all()


def test_eight_phases_a_cycle_in_the_papers_order(plan: Plan) -> None:
    names = [f"{p.kind} {p.leg}" for p in plan.phases[:8]]
    order = ("RH", "RF", "LH", "LF")
    assert names == [f"{kind} {leg}" for leg in order for kind in ("stance", "swing")]
    for before, after in zip(plan.phases, plan.phases[1:], strict=False):
        assert after.start == pytest.approx(before.end, abs=1e-9)
        assert (after.cog_start == before.cog_end).all()
    assert plan.phases[-1].end == pytest.approx(plan.duration)
    motion = plan.sample(0.05)
    assert set(motion.contacts.sum(axis=1)) == {3, 4}
    assert motion.contacts[-1].all()


def test_the_legs_reach_is_never_exceeded(plan: Plan) -> None:
    motion = plan.sample(0.1)
    for i, leg in enumerate(LEGS):
        hip = motion.cog + plan.robot.legs[leg].hip
        assert np.linalg.norm(motion.feet[:, i] - hip, axis=1).max() <= 0.57 + 1e-6


def test_feet_rise_seven_centimetres(plan: Plan) -> None:
    for phase in plan.phases[1:16:2]:
        times = np.linspace(phase.start, phase.end, 400)
        heights = plan.at(times).feet[:, LEGS.index(phase.leg), 2]
        assert heights.max() == pytest.approx(0.07, abs=2e-4)


def test_a_swing_takes_the_integral_of_one_over_the_highest_speed(plan: Plan) -> None:
    """Section IV integrated by quadrature along the box, with no samples of ours."""
    phase = plan.phases[9]
    leg = plan.robot.legs[phase.leg]
    a, d = phase.foot_start - phase.cog_start, phase.foot_end - phase.cog_start
    lift = np.array([0.0, 0.0, 0.07])
    total = 0.0
    for start, end in ((a, a + lift), (a + lift, d + lift), (d + lift, d)):
        length = float(np.linalg.norm(end - start))

        def slowness(s: float, start: Array = start, end: Array = end, length: float = length
                     ) -> float:  # fmt: skip
            q = leg.inverse(start + (end - start) * s / length)
            return 1.0 / float(arc_speed(foot_rates(leg, q, end - start), leg.velocity_limits))

        total += quad(slowness, 0.0, length, limit=200)[0]
    assert phase.duration == pytest.approx(total, rel=2e-3)


def test_at_a_slow_given_speed_time_is_length_over_speed(
    wang: Quadruped, columns: Footholds
) -> None:
    """[Wang2020], V.B.3: why 5 mm/s cannot give the paper's 272 s."""
    plan = plan_crawl(wang, columns, speed=0.005, timing="velocity")
    lengths = plan.cog_distance
    for leg in LEGS:
        hops = np.diff(columns[leg], axis=0)
        lengths += float(np.hypot(hops[:, 0], hops[:, 1]).sum()) + 2 * 0.07 * len(hops)
    assert plan.duration == pytest.approx(lengths / 0.005, rel=1e-4)
    assert plan.duration > 64 * 2 * 0.07 / 0.005 == pytest.approx(1792.0)
    assert {limit.kind for p in plan.phases if p.kind == "swing" for limit in p.limited_by} == {
        "speed"
    }


def test_a_given_speed_gives_way_to_the_joint_limits(plan: Plan) -> None:
    fast = plan_crawl(plan.robot, plan.footholds, speed=10.0, timing="velocity")
    assert fast.duration == pytest.approx(plan.duration, rel=1e-9)


def test_doubling_the_joint_limits_halves_the_time(
    wang: Quadruped, columns: Footholds, plan: Plan
) -> None:
    swift = gaitopt.Quadruped.from_urdf(
        wang.urdf.replace(repr(float(LIMIT)), repr(2 * float(LIMIT))), "swift"
    )
    assert swift.velocity_limits == pytest.approx(2 * LIMIT)
    doubled = plan_crawl(swift, columns, timing="velocity")
    assert doubled.duration == pytest.approx(plan.duration / 2, rel=1e-9)


def test_turning_the_world_turns_the_walk(wang: Quadruped, columns: Footholds, plan: Plan) -> None:
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned = Footholds({leg: columns[leg] @ turn.T + [3.0, -2.0, 0.5] for leg in LEGS})
    other = plan_crawl(wang, turned, heading=angle, timing="velocity")
    assert other.duration == pytest.approx(plan.duration, rel=1e-9)
    times = np.linspace(0, plan.duration, 50)
    a, b = plan.at(times), other.at(times * other.duration / plan.duration)
    assert b.cog == pytest.approx(a.cog @ turn.T + [3.0, -2.0, 0.5], abs=1e-6)
    assert b.q[:, 7:] == pytest.approx(a.q[:, 7:], abs=1e-5)


def test_a_mirrored_world_mirrors_the_walk(wang: Quadruped, columns: Footholds, plan: Plan) -> None:
    partner = {"LF": "RF", "LH": "RH", "RH": "LH", "RF": "LF"}
    mirrored = Footholds({partner[leg]: columns[leg] * [1, -1, 1] for leg in LEGS})
    sequence = tuple(partner[leg] for leg in ("RH", "RF", "LH", "LF"))
    other = plan_crawl(wang, mirrored, sequence=sequence, timing="velocity")
    assert other.duration == pytest.approx(plan.duration, rel=1e-9)
    assert other.cog_distance == pytest.approx(plan.cog_distance, rel=1e-6)


def test_the_paper_moves_less_and_the_margin_method_stands_safer(plan: Plan) -> None:
    shortest, safest = (
        plan,
        plan_crawl(plan.robot, plan.footholds, objective="margin", timing="velocity"),
    )
    assert shortest.cog_distance < 0.3 * safest.cog_distance
    assert shortest.duration < safest.duration
    assert safest.margin > shortest.margin
    swings = [p for p in zip(shortest.phases, safest.phases, strict=True) if p[0].kind == "swing"]
    assert all(b.margin >= a.margin - 1e-9 for a, b in swings)
    # An independent calculation gave 308 to 327 s.
    assert 308 < safest.duration < 327


def test_every_target_carries_its_evidence(plan: Plan) -> None:
    for phase in plan.phases[::2]:
        evidence = phase.evidence
        assert evidence is not None and evidence.status == "solved"
        assert evidence.primal <= 1e-9 and evidence.error_bound <= 1e-6
        held = {f"{x.kind} {x.name}" for x in phase.limited_by if x.kind in ("margin", "reach")}
        assert held == {name for name, value in evidence.multipliers.items() if value > 1e-6}


def test_limits_tell_which_joint_holds_the_phase_back_and_when(plan: Plan) -> None:
    columns = {name: 6 + i for i, name in enumerate(plan.robot.joint_names)}
    for phase in plan.phases[:40]:
        joints = [x for x in phase.limited_by if x.kind == "joint velocity"]
        if phase.duration == 0:
            assert not joints
            continue
        assert sum(x.value for x in joints) == pytest.approx(1.0)
        for limit in joints:
            for start, end in limit.spans:
                assert phase.start - 1e-9 <= start < end <= phase.end + 1e-9
                rates = plan.path.evaluate(np.linspace(start, end, 9)[1:-1], 1)
                assert np.abs(rates[:, columns[limit.name]]) == pytest.approx(LIMIT, rel=1e-6)


def test_uneven_ground_is_walked_and_judged_on_its_projection(wang: Quadruped) -> None:
    rough = gaitopt.s_columns(5, height_jitter=0.03)
    plan = plan_crawl(wang, rough, timing="velocity")
    assert plan.margin >= 0.02 - 1e-9
    for phase in plan.phases:
        if phase.kind == "swing":
            times = np.linspace(phase.start, phase.end, 200)
            top = plan.at(times).feet[:, LEGS.index(phase.leg), 2].max()
            higher = max(phase.foot_start[2], phase.foot_end[2])
            assert top == pytest.approx(higher + 0.07, abs=2e-4)
    assert np.ptp(plan.sample(1.0).cog[:, 2]) == pytest.approx(0.0, abs=1e-12)


def test_stairs_need_a_body_that_follows(wang: Quadruped, columns: Footholds) -> None:
    rise = np.array([0.0, 0.0, 0.04])
    stairs = Footholds({leg: columns[leg] + np.outer(np.arange(17), rise) for leg in LEGS})
    with pytest.raises(InfeasibleStepError, match="follow_terrain=True"):
        plan_crawl(wang, stairs, timing="velocity")
    plan = plan_crawl(wang, stairs, follow_terrain=True, timing="velocity")
    motion = plan.sample(0.5)
    assert motion.cog[-1, 2] - motion.cog[0, 2] == pytest.approx(0.64, abs=0.04)
    above = motion.cog[:, 2] - motion.feet[:, :, 2].mean(axis=1)
    assert np.abs(above - 0.40).max() < 0.06
    assert feet_by_pinocchio(wang, motion.q) == pytest.approx(motion.feet, abs=1e-9)


def test_following_level_ground_changes_nothing(plan: Plan) -> None:
    follow = plan_crawl(plan.robot, plan.footholds, follow_terrain=True, timing="velocity")
    assert follow.duration == pytest.approx(plan.duration, rel=1e-12)


@pytest.mark.parametrize(
    "name", ["wang2020", "wang2020-fast", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c",
             "hyq", "solo12"],
)  # fmt: skip
def test_every_robot_with_roll_joints_walks_columns_to_its_size_with_defaults(name: str) -> None:
    robot = gaitopt.load_robot(name)
    plan = plan_crawl(robot, s_columns(1, columns=5, robot=robot), timing="velocity")
    motion = plan.at(np.linspace(0, plan.duration, 300))
    assert feet_by_pinocchio(robot, motion.q) == pytest.approx(motion.feet, abs=1e-9)
    rates = np.abs(plan.path.coefficients[0][:, 6:])
    assert (rates.max(axis=0) <= robot.velocity_limits * (1 + 1e-9)).all()
    low, high = robot.model.lowerPositionLimit[7:], robot.model.upperPositionLimit[7:]
    assert (plan.path.knots()[:, 6:] >= low - 1e-9).all()
    assert (plan.path.knots()[:, 6:] <= high + 1e-9).all()
    still = motion.contacts
    for i in range(4):
        moved = np.linalg.norm(np.diff(motion.feet[:, i], axis=0), axis=1)
        assert moved[still[:-1, i] & still[1:, i]].max() < 1e-4
    assert plan.margin >= 0.05 * robot.standing_height - 1e-4


def test_a_walk_of_no_steps_stands(wang: Quadruped) -> None:
    plan = plan_crawl(wang, flat_footholds(wang, 1, 0.1), timing="velocity")
    assert (plan.duration, plan.phases, plan.mean_speed) == (0.0, (), 0.0)
    motion = plan.sample(0.1)
    assert len(motion) == 1 and motion.contacts.all()
    assert motion.cog == pytest.approx(np.array([[0.0, 0.0, 0.4]]), abs=1e-9)


def test_the_body_can_be_told_where_to_start(wang: Quadruped) -> None:
    footholds = flat_footholds(wang, 2, 0.1)
    plan = plan_crawl(wang, footholds, cog_start=(0.03, -0.02), timing="velocity")
    assert plan.phases[0].cog_start == pytest.approx([0.03, -0.02, 0.4])
    with pytest.raises(InfeasibleStepError, match=r"cannot start at \[2.0, 0.0\]: reach"):
        plan_crawl(wang, footholds, cog_start=(2.0, 0.0), timing="velocity")
    with pytest.raises(InputError, match="two finite numbers"):
        plan_crawl(wang, footholds, cog_start=(np.nan, 0.0), timing="velocity")


def test_a_margin_too_large_is_told_with_the_largest_that_works(wang: Quadruped) -> None:
    footholds = flat_footholds(wang, 3, 0.1)
    with pytest.raises(InfeasibleStepError) as caught:
        plan_crawl(wang, footholds, stability_margin=0.25, timing="velocity")
    error = caught.value
    assert (error.step, error.leg, error.margin) == (0, "RH", 0.25)
    assert error.largest_margin is not None and 0.05 < error.largest_margin < 0.15
    assert "inscribed circle of the support triangle LF-LH-RF" in str(error)
    assert f"stability_margin up to {np.floor(error.largest_margin * 1e4) / 1e4:.4f} m" in str(
        error
    )


def test_the_advice_of_an_error_is_right(wang: Quadruped) -> None:
    """What the error says would work does, and what lies just beyond it does not."""
    footholds = flat_footholds(wang, 2, 0.4)
    asked: dict[str, Any] = {"body_height": 0.5, "stability_margin": 0.05, "reach_fraction": 0.97}
    with pytest.raises(InfeasibleStepError) as caught:
        plan_crawl(wang, footholds, **asked, timing="velocity")
    error = caught.value
    assert error.step == 0 and set(error.conflicts) == {"margin RF-LF", "reach RH foothold"}
    assert error.largest_margin == pytest.approx(0.036, abs=1e-3)
    assert error.needed_reach_fraction == pytest.approx(0.981, abs=1e-3)
    assert error.largest_margin is not None and error.needed_reach_fraction is not None
    for setting, limit, better in (
        ("stability_margin", error.largest_margin, -1e-6),
        ("reach_fraction", error.needed_reach_fraction, 1e-6),
    ):
        assert _first_refused(wang, footholds, {**asked, setting: limit + better}) != 0
        assert _first_refused(wang, footholds, {**asked, setting: limit - better}) == 0


def _first_refused(robot: Quadruped, footholds: Footholds, settings: dict[str, Any]) -> int | None:
    """The step that cannot be made with these settings, if any."""
    try:
        plan_crawl(robot, footholds, **settings, timing="velocity")
    except InfeasibleStepError as error:
        return error.step
    return None


def test_footholds_out_of_reach_are_named(wang: Quadruped) -> None:
    footholds = flat_footholds(wang, 3, 0.9)
    with pytest.raises(InfeasibleStepError) as caught:
        plan_crawl(wang, footholds, timing="velocity")
    error = caught.value
    assert error.largest_margin is None
    assert error.needed_reach_fraction is not None and error.needed_reach_fraction > 1
    assert "more than straight legs have" in str(error)
    assert f"step {error.step} ({error.leg}" in str(error)


def test_a_first_stance_too_wide_is_named(wang: Quadruped) -> None:
    wide = {leg: p * [1.0, 8.0, 1.0] for leg, p in flat_footholds(wang, 2, 0.1).points.items()}
    with pytest.raises(InfeasibleStepError, match="first footholds lie too far apart"):
        plan_crawl(wang, Footholds(wide), timing="velocity")


def test_a_height_that_no_leg_reaches_is_named(wang: Quadruped, columns: Footholds) -> None:
    with pytest.raises(InfeasibleStepError, match=r"take body_height below 0\.57 m"):
        plan_crawl(wang, columns, body_height=0.6, timing="velocity")


def test_a_swing_that_folds_the_leg_too_far_is_named(wang: Quadruped, columns: Footholds) -> None:
    with pytest.raises(InfeasibleStepError, match="change swing_height or body_height"):
        plan_crawl(wang, columns, swing_height=0.33, body_height=0.40, timing="velocity")


def test_a_joint_beyond_its_limits_is_named() -> None:
    hyq = gaitopt.load_robot("hyq")
    with pytest.raises(InfeasibleStepError, match=r"joint lh_hfe_joint would turn to -1\.\d+ rad"):
        plan_crawl(
            hyq, s_columns(robot=hyq), body_height=0.54, swing_height=0.095, timing="velocity"
        )


def test_a_joint_without_velocity_limit_is_named(wang: Quadruped, columns: Footholds) -> None:
    still = gaitopt.Quadruped.from_urdf(wang.urdf.replace(repr(float(LIMIT)), "0.0"))
    with pytest.raises(InputError, match="joint LF_HAA has no velocity limit"):
        plan_crawl(still, columns, timing="velocity")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"objective": "fast"}, "objective must be one of distance, margin, got 'fast'"),
        ({"speed": -1.0}, r"speed must be a number .* got -1.0 \(or 'max'\)"),
        ({"speed": "fast"}, "speed must be a number"),
        ({"stability_margin": -0.1}, "stability_margin must be a number from 0"),
        ({"stability_margin": float("nan")}, "stability_margin must be"),
        ({"body_height": 0.0}, "body_height must be"),
        ({"body_height": True}, "body_height must be"),
        ({"swing_height": -0.1}, "swing_height must be"),
        ({"swing": "spiral"}, "swing must be one of box"),
        ({"sequence": ("RH", "RF", "LH")}, "sequence must name each of LF, LH, RH, RF once"),
        ({"sequence": ("RH", "RF", "LH", "XX")}, "got RH, RF, LH, XX"),
        ({"reach_fraction": 1.5}, "reach_fraction must be"),
        ({"heading": float("inf")}, "heading must be"),
    ],
)
def test_settings_out_of_range(
    wang: Quadruped, columns: Footholds, setting: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        plan_crawl(wang, columns, **setting, timing="velocity")


def test_progress_is_reported(wang: Quadruped) -> None:
    seen: list[tuple[int, int]] = []
    plan_crawl(
        wang,
        gaitopt.s_columns(0, columns=3),
        progress=lambda done, total: seen.append((done, total)),
        timing="velocity",
    )
    assert seen == [(k, 8) for k in range(1, 9)]


def test_many_random_terrains_are_walked(wang: Quadruped) -> None:
    times = []
    for seed in range(40):
        plan = plan_crawl(wang, gaitopt.s_columns(seed), timing="velocity")
        assert plan.margin >= 0.02 - 1e-9
        times.append(plan.duration)
    assert min(times) > 205 and max(times) < 236


NECK = (
    '<link name="head"/><joint name="neck" type="revolute"><parent link="base"/>'
    '<child link="head"/><axis xyz="0 1 0"/>'
    '<limit lower="-1" upper="1" velocity="0" effort="1"/></joint></robot>'
)


def test_a_joint_that_belongs_to_no_leg_stands_still(
    wang: Quadruped, columns: Footholds, plan: Plan
) -> None:
    """A neck that may not move at all must not divide 0 by 0."""
    headed = plan_crawl(
        Quadruped.from_urdf(wang.urdf.replace("</robot>", NECK), "headed"),
        columns,
        timing="velocity",
    )
    assert headed.duration == pytest.approx(plan.duration, rel=1e-12)
    motion = headed.sample(1.0)
    assert np.isfinite(motion.q).all()
    assert not motion.q[:, 7 + motion.joint_names.index("neck")].any()


@pytest.mark.parametrize("east", [5e4, 5e5, 9e5])
def test_far_coordinates_change_nothing(
    wang: Quadruped, columns: Footholds, plan: Plan, east: float
) -> None:
    """Maps count in hundreds of kilometres."""
    far = Footholds({leg: columns[leg] + [east, -east / 2, 0.0] for leg in LEGS})
    away = plan_crawl(wang, far, timing="velocity")
    assert away.duration == pytest.approx(plan.duration, rel=1e-6)
    assert away.margin == pytest.approx(0.02, abs=1e-8)


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        ({"LF": "RF", "RF": "LF"}, "first foothold of LF is not left of that of RF"),
        ({"LF": "LH", "LH": "LF"}, "first foothold of LF is not ahead of that of LH"),
    ],
)
def test_swapped_legs_are_noticed(
    wang: Quadruped, columns: Footholds, swap: dict[str, str], words: str
) -> None:
    swapped = Footholds({leg: columns[swap.get(leg, leg)] for leg in LEGS})
    with pytest.raises(InputError, match=words):
        plan_crawl(wang, swapped, timing="velocity")


def test_a_forgotten_heading_is_noticed(wang: Quadruped, columns: Footholds) -> None:
    sideways = Footholds({leg: columns[leg][:, [1, 0, 2]] * [-1, 1, 1] for leg in LEGS})
    with pytest.raises(InputError, match="swap the footholds of these legs, or set heading"):
        plan_crawl(wang, sideways, timing="velocity")
    assert plan_crawl(wang, sideways, heading=np.pi / 2, timing="velocity").margin >= 0.02 - 1e-9


def test_a_heading_in_degrees_is_noticed(wang: Quadruped, columns: Footholds) -> None:
    for make in (plan_crawl, gaitopt.plan_route):
        with pytest.raises(InputError, match=r"heading .* got 90\.0 \(90 degrees are 1\.5708 rad"):
            make(wang, columns, heading=90.0, timing="velocity")
    with pytest.raises(InputError, match="set heading"):
        plan_crawl(wang, columns, heading=2.0, timing="velocity")


@pytest.mark.parametrize(("name", "height"), [("anymal", 0.10), ("solo12", 0.03)])
def test_a_body_too_low_is_refused_rather_than_walked_wrongly(name: str, height: float) -> None:
    """Folded that far, inverse kinematics has no continuous answer."""
    robot = gaitopt.load_robot(name)
    with pytest.raises(
        InfeasibleStepError, match=r"knee allows|more than half a turn|nearer to its roll axis"
    ):
        plan_crawl(
            robot,
            s_columns(robot=robot),
            objective="margin",
            body_height=height,
            swing_height=0.01,
            timing="velocity",
        )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"robot": "wang2020"}, "robot must be a Quadruped, got a str; gaitopt.load_robot"),
        ({"footholds": {}}, "footholds must be a Footholds, got a dict; gaitopt.Footholds"),
        ({"sequence": None}, "sequence must name each"),
        ({"cog_start": "ab"}, "cog_start must be two finite numbers"),
        ({"follow_terrain": "no"}, "follow_terrain must be True or False"),
    ],
)
def test_arguments_of_another_kind(
    wang: Quadruped, columns: Footholds, arguments: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        plan_crawl(**{"robot": wang, "footholds": columns, **arguments}, timing="velocity")


def test_the_printed_advice_can_be_followed_to_the_letter(wang: Quadruped) -> None:
    """What the message prints, rounded as it is, works at this step."""
    followed = 0
    for stride in (0.3, 0.35, 0.4):
        for height in (0.5, 0.52, 0.53):
            footholds = flat_footholds(wang, 2, stride)
            asked = {"body_height": height, "stability_margin": 0.05, "reach_fraction": 0.97}
            try:
                plan_crawl(wang, footholds, **asked, timing="velocity")  # type: ignore[arg-type]
            except InfeasibleStepError as error:
                found = re.search(r"need reach_fraction (\d\.\d+)", str(error))
                if found and float(found[1]) <= 1.0:
                    better = {**asked, "reach_fraction": float(found[1])}
                    refused = _first_refused(wang, footholds, better)
                    assert refused is None or refused > error.step
                    followed += 1
    assert followed >= 3
