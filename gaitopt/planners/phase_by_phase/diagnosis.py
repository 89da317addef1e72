"""Errors that say why a step is impossible, and what would make it possible."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.optimize.cog.solver import CogSolution, build_cog_problem, solve_cog
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.demands import Demands
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped

RESERVE = 1e-7
"""By how much the largest margin must exceed the one that is asked for, so that a step counts as
possible [m]. Chosen here: the area that is left is then wider than the solver's tolerances."""
UNLIMITED_REACH = 100.0
"""Reach fraction with which no leg limits anything: legs a hundred times as long."""
DIGITS = 1e4
"""Numbers that an error proposes are rounded to 1 / DIGITS, to the safe side [1/m, 1]."""


def check_heights(robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings) -> None:
    """Check that every leg reaches a foot straight below its hip.

    Raises:
        InfeasibleStepError: the body is too high for it. Names the leg, the step, and the largest
            height that is possible.
    """
    feet_z = np.concatenate([steps.feet[..., 2], steps.feet[:1, :, 2]])
    heights = np.append(steps.heights, steps.start_height)[: len(steps.feet)]
    for column, name in enumerate(LEGS):
        leg = robot.legs[name]
        drop = heights + _hip_heights(robot, steps, leg) - feet_z[: len(heights), column]
        reach = settings.reach_fraction * leg.reach + leg.drop
        farthest = float(np.hypot(reach, leg.lateral))
        worst = int(drop.argmax())
        if drop[worst] > farthest:
            excess = drop[worst] - farthest
            if steps.tilts is not None:
                raise InfeasibleStepError(
                    f"step {worst}: in the posture that the footholds ask for, with the body "
                    f"centre at {heights[worst]:.4g} m, the hip of {name} is {drop[worst]:.4g} m "
                    f"above its foot, and the leg reaches {farthest:.4g} m; lower the body by at "
                    f"least {excess:.4g} m, or tilt it less",
                    step=worst, leg=name, conflicts=(f"reach {name}",),
                    reach_fraction=settings.reach_fraction,
                )  # fmt: skip
            raise InfeasibleStepError(
                f"step {worst}: at body_height {settings.body_height:.4g} m the hip of {name} is "
                f"{drop[worst]:.4g} m above its foot, and the leg reaches {farthest:.4g} m; take "
                f"body_height below {settings.body_height - excess:.4g} m"
                + ("" if settings.follow_terrain or np.ptp(feet_z) == 0 else
                   ", or follow_terrain=True"),
                step=worst, leg=name, conflicts=(f"reach {name}",),
                reach_fraction=settings.reach_fraction,
                needed_reach_fraction=_needed_straight_down(leg, float(drop[worst])),
            )  # fmt: skip


def _hip_heights(robot: Quadruped, steps: CrawlSteps, leg: Leg) -> FloatArray | float:
    """Height of a leg's hip over the body centre [m], as :func:`check_heights` counts steps."""
    if steps.turns is None:
        return float(leg.hip[2] - robot.centre[2])
    turns = np.concatenate([steps.turns[1:], steps.turns[:1]])[: len(steps.feet)]
    return np.asarray(turns[:, 2] @ (np.asarray(leg.hip) - robot.centre))


def explain_step(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    step: int,
    place: FloatArray,
    demands: Demands | None = None,
) -> InfeasibleStepError | SolverError:
    """The error for a step whose COG problem has no verified solution.

    Args:
        robot, steps, settings: the walk.
        step: index of the step.
        place: body centre before the step ``(2,)`` [m], in the heading frame.
        demands: what is asked of this step's target beside eq. (10).

    Returns:
        An InfeasibleStepError with the largest margin and the smallest reach fraction that allow
        the step; a SolverError if the step is possible after all.
    """
    leg = steps.legs[step]
    if demands is not None and demands.regions[0] is not None:
        free = _solve(robot, steps, settings, step, place, "margin", demands.without_regions())
        if free.solved and free.value > settings.stability_margin + RESERVE:
            return not_held(steps, settings, step)
        demands = demands.without_regions()
    best = _solve(robot, steps, settings, step, place, "margin", demands)
    least = _solve(robot, steps, settings, step, place, "reach", demands)
    if best.solved and best.value > settings.stability_margin + RESERVE:
        return SolverError(
            f"step {step} ({leg}): the COG problem has a solution (margin {best.value:.4g} m) but "
            f"was not solved to tolerance; please report this, with the plan's inputs",
            step=step,
        )
    where = f"step {step} ({leg} onto its foothold at {np.round(steps.targets[step], 4).tolist()})"
    inscribed = _inscribed_radius(robot, steps, settings, step, place)
    triangle = "-".join(other for other in LEGS if other != leg)
    margin = settings.stability_margin
    largest = best.value if best.solved else None
    needed = least.value if least.solved else None
    if inscribed is not None and inscribed < margin:
        message = (
            f"{where}: a margin of {margin:.4g} m is larger than the inscribed circle of the "
            f"support triangle {triangle}, {inscribed:.4g} m"
        )
        conflicts: tuple[str, ...] = tuple(n for n in best.active if n.startswith("margin"))
    elif largest is None:
        message = f"{where}: no place of the body lets all legs reach their footholds"
        conflicts = tuple(n for n in least.active if n.startswith("reach"))
    else:
        message = (
            f"{where}: the support triangle {triangle} shrunken by {margin:.4g} m and the reach of "
            f"the legs have no point in common ({', '.join(best.active)})"
        )
        conflicts = best.active
    return InfeasibleStepError(
        f"{message}; {_remedies(settings, largest, needed)}",
        step=step, leg=leg, conflicts=conflicts, margin=margin, largest_margin=largest,
        reach_fraction=settings.reach_fraction, needed_reach_fraction=needed,
    )  # fmt: skip


def not_held(steps: CrawlSteps, settings: CrawlSettings, step: int) -> InfeasibleStepError:
    """The error for a step during whose swing no contact forces hold the robot.

    Args:
        steps, settings: the walk.
        step: index of the step.
    """
    leg, forces = steps.legs[step], settings.forces
    legs = "-".join(other for other in LEGS if other != leg)
    asked = "" if forces is None else (
        f" (torque_share {forces.torque_share:.4g}, reserve {forces.reserve:.4g}, friction "
        f"{forces.friction:.4g})"
    )  # fmt: skip
    return InfeasibleStepError(
        f"step {step} ({leg} onto its foothold at {np.round(steps.targets[step], 4).tolist()}): no "
        f"place of the body was found at which {legs} hold the robot with contact forces within "
        f"their limits{asked}, with a margin of {settings.stability_margin:.4g} m at body_height "
        f"{settings.body_height:.4g} m; take another stability_margin or body_height, or allow "
        "more friction or torque, or less reserve",
        step=step, leg=leg, conflicts=("contact forces",), margin=settings.stability_margin,
        reach_fraction=settings.reach_fraction,
    )  # fmt: skip


def explain_start(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, wanted: FloatArray
) -> InfeasibleStepError:
    """The error for a first stance that the legs do not reach from any place of the body.

    Args:
        robot, steps, settings: the walk.
        wanted: where the body centre was to start ``(2,)`` [m], in the heading frame.
    """
    feet = dict(zip(LEGS, steps.feet[0], strict=True))
    least = solve_cog(
        build_cog_problem(
            robot, feet, steps.start_height, wanted, objective="reach",
            turn=None if steps.turns is None else steps.turns[0],
        )
    )  # fmt: skip
    needed = least.value if least.solved else None
    return InfeasibleStepError(
        "the first footholds lie too far apart: no place of the body lets all four legs reach "
        f"them; {_remedies(settings, None, needed)}",
        step=-1, leg=_first_leg(least.active), conflicts=least.active,
        margin=settings.stability_margin, reach_fraction=settings.reach_fraction,
        needed_reach_fraction=needed,
    )  # fmt: skip


def _first_leg(conflicts: tuple[str, ...]) -> str:
    """The leg that the first reach constraint among ``conflicts`` names."""
    return next((leg for name in conflicts for leg in LEGS if leg in name.split()), "")


def _needed_straight_down(leg: Leg, drop: float) -> float:
    """Reach fraction that a leg needs for a foot ``drop`` [m] straight below its hip."""
    return (float(np.sqrt(drop**2 - leg.lateral**2)) - leg.drop) / leg.reach


def _solve(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    step: int,
    place: FloatArray,
    objective: str,
    demands: Demands | None = None,
    reach_fraction: float | None = None,
) -> CogSolution:
    """The solution of one step's COG problem from ``place (2,)``, with another objective."""
    problem = build_cog_problem(
        robot, dict(zip(LEGS, steps.feet[step], strict=True)), float(steps.heights[step]), place,
        swing=steps.legs[step], foothold=steps.targets[step],
        stability_margin=settings.stability_margin,
        reach_fraction=settings.reach_fraction if reach_fraction is None else reach_fraction,
        objective=objective,  # type: ignore[arg-type]
        shifts=None if demands is None or demands.shifts is None else demands.shifts[0],
        further=None if demands is None else demands.half_planes[0],
        turn=None if steps.swing_turns is None else steps.swing_turns[step],
    )  # fmt: skip
    return solve_cog(problem)


def _inscribed_radius(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, step: int, place: FloatArray
) -> float | None:
    """Radius of the support triangle's inscribed circle [m]: the largest margin with any legs."""
    largest = _solve(robot, steps, settings, step, place, "margin", reach_fraction=UNLIMITED_REACH)
    return largest.value if largest.solved else None


def _remedies(settings: CrawlSettings, largest: float | None, needed: float | None) -> str:
    """What the user can change, in words.

    Args:
        settings: of the walk.
        largest: the largest margin that is possible with these legs [m], if any is.
        needed: the smallest reach fraction that is possible with this margin, if any is.
    """
    options = []
    if largest is not None and largest > 0:
        # Rounded down, so that a margin of this size is possible.
        margin = float(np.floor(largest * DIGITS) / DIGITS)
        options.append(f"stability_margin up to {margin:.4f} m works here")
    if needed is not None:
        # Rounded up, so that a reach of this size suffices.
        needed = float(np.ceil(needed * DIGITS) / DIGITS)
        text = f"with this margin the legs need reach_fraction {needed:.4f}"
        if needed > 1.0:
            text += " (more than straight legs have; try a lower body_height)"
        options.append(f"{text}, now {settings.reach_fraction:.4g}")
    return "; ".join(options) or "no margin and no reach helps: move the foothold"
