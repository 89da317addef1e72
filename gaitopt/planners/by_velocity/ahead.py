"""Which gaits a robot without roll joints can walk with contact forces.

Its body moves ahead only. The ZMP must then be where the standing feet can push, and near the
middle line. While two feet stand it is at one place, so that the body's motion follows from how it
begins. A choice is left in phases in which all four feet stand.
"""

from __future__ import annotations

from gaitopt.conventions import LEGS
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.robots.quadruped import Quadruped


def why_not_ahead(robot: Quadruped, settings: GaitSettings) -> str | None:
    """Why a robot whose body moves ahead only finds no contact forces for a gait.

    ``None`` where it may find them, and for robots whose legs can all step aside.

    Args:
        robot: the robot.
        settings: of the gait.
    """
    flat = [leg.name for leg in robot.legs.values() if not leg.has_roll]
    if not flat:
        return None
    body = f"{robot.name} has legs without roll joint, whose body moves ahead only"
    if settings.velocity[1] != 0.0 or settings.yaw_rate != 0.0:
        return f"{body}: give a velocity straight ahead, and yaw_rate=0"
    schedule = settings.schedule
    if not _both_sides_stand(schedule):
        return f"{body}: in a {schedule.name} it would fall to the side; take a trot or a walk"
    if not _rests(schedule):
        return (
            f"{body}: between phases with feet in the air it needs phases of four feet: give a "
            "longer duty factor, as in trot(0.5, 0.6) and walk(2.0, 0.85)"
        )
    return None


def _both_sides_stand(schedule: GaitSchedule) -> bool:
    """Whether a left and a right foot stand at all times."""
    found = [{leg[0] for leg in phase.support} for phase in schedule.intervals(schedule.cycle_time)]
    return all(sides == {"L", "R"} for sides in found)


def _rests(schedule: GaitSchedule) -> bool:
    """Whether all four feet stand between phases with feet in the air."""
    phases = schedule.intervals(schedule.cycle_time)
    counts = [len(phase.support) for phase in phases]
    following = [*counts[1:], counts[0]]
    ends_whole = phases[0].support == phases[-1].support
    pairs = list(zip(counts, following, strict=True))
    # The cycle begins again in the phase in which it ended.
    return all(len(LEGS) in pair for pair in (pairs[:-1] if ends_whole else pairs))
