"""What notebooks show of an object: a small picture and a few lines, as HTML."""

from __future__ import annotations

from gaitopt.conventions import LEGS
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.notebook.pictures import (
    footholds_picture,
    ground_picture,
    plan_picture,
    robot_picture,
    table,
)


def plan_card(plan: Plan) -> str:
    """A plan: its paths from above, its numbers, and what limits it."""
    rows = [
        ("robot", plan.robot.name),
        ("steps", str(len(plan.swings))),
        ("distance", f"{plan.distance:.2f} m"),
        ("duration", f"{plan.duration:.2f} s ({1e3 * plan.mean_speed:.1f} mm/s)"),
    ]
    if plan.settings.static:
        of = "true centre of mass" if plan.settings.true_com else "body centre"
        rows.append(("stability margin", f"at least {1e3 * plan.margin:.1f} mm ({of})"))
    limits = plan.settings.promised_forces
    rows.append(("promises", "joint limits only: kinematics" if limits is None else
                 f"contact forces: friction {limits.friction:g}, {limits.reserve:.0%} of the "
                 f"weight in reserve, {limits.torque_share:.0%} of the torque"))  # fmt: skip
    holding = _most_limiting(plan)
    if holding:
        rows.append(("most often limited by", holding))
    return _card(plan_picture(plan), table(rows), _legend())


def footholds_card(footholds: Footholds) -> str:
    """Footholds: the map from above, and how many there are."""
    rows = [("footholds", ", ".join(f"{leg} {footholds.counts[leg]}" for leg in LEGS)),
            ("steps", str(footholds.steps))]  # fmt: skip
    if footholds.radius is not None:
        rows.append(("columns", f"{2e3 * footholds.radius:.0f} mm wide"))
    return _card(footholds_picture(footholds), table(rows), _legend())


def ground_card(ground: HeightMap) -> str:
    """A height map from above: light is high, white is unknown."""
    return _card(ground_picture(ground), table([("ground", repr(ground)[len("HeightMap(") : -1])]))


def robot_card(robot: Quadruped) -> str:
    """A robot: standing, seen from its left side, with its sizes and the limits of a leg."""
    length, width = robot.stance_size
    rows = [
        ("name", robot.name),
        ("mass", f"{robot.mass:.4g} kg"),
        ("stance", f"{length:.3f} x {width:.3f} m, hips {robot.standing_height:.2f} m high"),
        ("feet", f"balls of {1e3 * robot.foot_radius:.4g} mm"),
    ]
    leg = robot.legs["LF"]
    for i, joint in enumerate(leg.joints):
        low, high = leg.position_limits[:, i]
        effort = robot.effort_limits[robot.leg_columns["LF"][i]]
        rows.append((joint, f"{low:.3g} .. {high:.3g} rad, {leg.velocity_limits[i]:.4g} rad/s, "
                     f"{effort:.4g} N m"))  # fmt: skip
    rows += [("warning", text) for text in robot.notes.warnings[:3]]
    return _card(robot_picture(robot), table(rows), _legend())


def _most_limiting(plan: Plan) -> str:
    """What holds the plan back in most of its time, in words; empty where nobody knows."""
    times: dict[str, float] = {}
    for phase in plan.phases:
        for limit in phase.limited_by:
            name = f"{limit.kind}: {limit.name}"
            times[name] = times.get(name, 0.0) + phase.duration
    if not times or not plan.duration:
        return ""
    name = max(times, key=lambda each: times[each])
    return f"{name} ({times[name] / plan.duration:.0%} of the time)"


def _legend() -> str:
    names = "".join(
        f'<span style="color:{LEG_COLOURS[leg]}">&#9679;</span> {leg} &nbsp;' for leg in LEGS
    )
    return f"<div>{names}<span>&#9473;</span> body centre</div>"


def _card(picture: str, *parts: str) -> str:
    inside = "".join(parts)
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:14px;align-items:flex-start">'
        f"<div>{picture}</div><div>{inside}</div></div>"
    )
