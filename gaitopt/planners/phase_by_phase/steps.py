"""The steps of a walk: which leg swings when, from where to where. Nothing is optimised here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index, rotation_z
from gaitopt.dynamics.contacts import LEVEL_GROUND, ContactGround
from gaitopt.errors import InputError
from gaitopt.gait.crawl import swing_order
from gaitopt.plan.contact_ground import ground_on
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class CrawlSteps:
    """The steps of a walk, in the heading frame.

    Attributes:
        legs: the leg that swings at each step ``(S,)``.
        feet: where the feet stand before each step ``(S, 4, 3)`` [m].
        targets: where the swing foot touches down ``(S, 3)`` [m].
        lifts: how far the foot rises above the higher end of each swing ``(S,)`` [m].
        heights: height of the body centre at the end of each stance phase ``(S,)`` [m].
        start_height: its height at the start [m].
        heading: of the frame, from the world's x axis [rad].
        tilts: roll, pitch, yaw of the body against the frame at the start and during each swing
            ``(S + 1, 3)`` [rad]; ``None`` where it is level and faces along the frame's x axis.
        ground: below the feet before each step, for ``S`` samples; normals are in the world.
        wanted: where the body centre is wanted at the start and during each swing ``(S + 1, 2)``
            [m]; ``None`` where it is to move as little as possible.
    """

    legs: tuple[str, ...]
    feet: FloatArray
    targets: FloatArray
    lifts: FloatArray
    heights: FloatArray
    start_height: float
    heading: float = 0.0
    tilts: FloatArray | None = None
    ground: ContactGround = LEVEL_GROUND
    wanted: FloatArray | None = None

    def part(self, first: int, last: int) -> CrawlSteps:
        """The steps from ``first`` up to, not including, ``last``."""
        own = slice(first, last)
        tilts = None if self.tilts is None else self.tilts[first : last + 1]
        wanted = None if self.wanted is None else self.wanted[first : last + 1]
        return CrawlSteps(self.legs[own], self.feet[own], self.targets[own], self.lifts[own],
                          self.heights[own], self.start_height, self.heading, tilts,
                          self.ground.at(np.arange(len(self.legs))[own]),
                          wanted)  # fmt: skip

    @cached_property
    def turns(self) -> FloatArray | None:
        """Rotations from the body's axes to the frame's, of :attr:`tilts` ``(S + 1, 3, 3)``."""
        return None if self.tilts is None else rpy_to_matrix(self.tilts)

    @property
    def swing_turns(self) -> FloatArray | None:
        """The same during the swings ``(S, 3, 3)``."""
        return None if self.turns is None else self.turns[1:]

    @cached_property
    def indices(self) -> np.ndarray:
        """Index of each step's leg in :data:`gaitopt.LEGS` ``(S,)``."""
        return np.array([leg_index(leg) for leg in self.legs], dtype=int)


def feet_in_body(
    robot: Quadruped, feet: FloatArray, cogs: FloatArray, turns: FloatArray | None
) -> FloatArray:
    """Feet in the body's frame ``(M, n, 3)`` [m].

    Args:
        robot: the robot.
        feet: in the heading frame ``(M, n, 3)`` [m].
        cogs: body centre there ``(M, 3)`` [m].
        turns: rotations from the body's axes to the frame's ``(M, 3, 3)``; ``None`` where there is
            none.
    """
    away = feet - cogs[:, None]
    return (away if turns is None else away @ turns) + robot.centre


def check_walk(planner: str, robot: object, footholds: object) -> None:
    """Check that a planner got a robot and footholds.

    Args:
        planner: name of the planner, for the message.
        robot, footholds: what it was given.

    Raises:
        InputError: one of them is something else; names their types.
    """
    if not isinstance(robot, Quadruped) or not isinstance(footholds, Footholds):
        raise InputError(
            f"{planner} takes a Quadruped (from load_robot) and Footholds, got "
            f"{type(robot).__name__} and {type(footholds).__name__}"
        )


def check_roll(planner: str, robot: Quadruped) -> None:
    """Check that all legs have roll joints.

    Args:
        planner: name of the planner, for the message.
        robot: the robot.

    Raises:
        InputError: a leg has none; names it.
    """
    for name, leg in robot.legs.items():
        if not leg.has_roll:
            raise InputError(
                f"{robot.name}: leg {name} has no roll joint, and {planner} moves feet sideways; "
                "plan_crawl without objective='time' (gaitopt walk) walks straight ahead, and "
                "plan_stride (gaitopt stride) goes over an obstacle"
            )


def check_stance(steps: CrawlSteps) -> None:
    """Check that legs do not cross in the first stance, seen along the body.

    Raises:
        InputError: two do. Names both; they may be swapped, or the heading forgotten.
    """
    turn = 0.0 if steps.tilts is None else float(steps.tilts[0, 2])
    first = dict(zip(LEGS, steps.feet[0] @ rotation_z(turn), strict=True))
    for axis, side, pairs in (
        (1, "left of", (("LF", "RF"), ("LH", "RH"))),
        (0, "ahead of", (("LF", "LH"), ("RF", "RH"))),
    ):
        for one, other in pairs:
            if not first[one][axis] > first[other][axis]:
                raise InputError(
                    f"the first foothold of {one} is not {side} that of {other}, seen in the "
                    "direction of walking; swap the footholds of these legs, or set heading"
                )


def mean_height(footholds: Footholds) -> float:
    """Mean height of all footholds [m]."""
    if len(set(footholds.counts.values())) == 1:
        return float(footholds.array[..., 2].mean())
    return float(np.concatenate([footholds[leg][:, 2] for leg in LEGS]).mean())


def swing_lifts(
    footholds: Footholds, order: Sequence[tuple[str, int]], height: float
) -> FloatArray:
    """How far the foot rises above the higher end of each swing ``(S,)`` [m].

    Args:
        footholds: which may say it of each swing.
        order: the legs, and the footholds that they step onto.
        height: where they do not [m].
    """
    if footholds.swing_heights is None:
        return np.full(len(order), height)
    return np.array([footholds.swing_heights[leg][k - 1] for leg, k in order], dtype=np.float64)


def crawl_steps(footholds: Footholds, settings: CrawlSettings) -> CrawlSteps:
    """All steps of a walk: which leg swings onto which foothold, and how high the body is.

    Args:
        footholds: in the world. Their postures hold in place of the settings' body height.
        settings: order of legs, heading and body height.

    Raises:
        InputError: the order of legs does not fit the number of footholds, or is another than that
            which postures go with.
    """
    points = footholds.array @ rotation_z(settings.heading)
    order = swing_order(settings.order_over(footholds), footholds.counts)
    stands = np.zeros((len(order) + 1, len(LEGS)), dtype=int)
    for s, (leg, k) in enumerate(order):
        stands[s + 1] = stands[s]
        stands[s + 1, leg_index(leg)] = k
    feet = points[np.arange(len(LEGS)), stands]
    if settings.follow_terrain:
        ground = feet[:, :, 2].mean(axis=1)
        levels = (ground[:-1] + ground[1:]) / 2.0
        first = float(ground[0])
    else:
        first = mean_height(footholds)
        levels = np.full(len(order), first)
    if footholds.postures is not None and tuple(leg for leg, _ in order) != footholds.order:
        raise InputError(
            "postures of the body go with the order of the footholds, and another sequence is "
            "asked for; leave sequence out, or postures"
        )
    steps = CrawlSteps(
        legs=tuple(leg for leg, _ in order),
        feet=feet[:-1] if order else feet,
        targets=np.array([points[leg_index(leg), k] for leg, k in order]).reshape(-1, 3),
        lifts=swing_lifts(footholds, order, settings.swing_height),
        heights=levels + settings.body_height,
        start_height=first + settings.body_height,
        heading=settings.heading,
        ground=_ground_of(footholds, settings, stands[: max(len(order), 1)]),
        wanted=_wanted(footholds, order, settings.heading),
    )
    return steps if footholds.postures is None else _with_postures(steps, footholds.postures)


def _wanted(
    footholds: Footholds, order: Sequence[tuple[str, int]], heading: float
) -> FloatArray | None:
    """Where the body centre is wanted, in the heading frame; places go with their own order."""
    places = footholds.body_places
    if places is None or tuple(leg for leg, _ in order) != footholds.order:
        return None
    return np.asarray(places @ rotation_z(heading)[:2, :2])


def _ground_of(footholds: Footholds, settings: CrawlSettings, stands: np.ndarray) -> ContactGround:
    """The ground below the feet, where forces are asked for.

    Args:
        footholds, settings: of the walk.
        stands: the foothold on which each foot stands ``(S, 4)``.
    """
    if settings.forces is None:
        return LEVEL_GROUND
    return ground_on(footholds, stands, settings.forces.friction)


def _with_postures(steps: CrawlSteps, postures: FloatArray) -> CrawlSteps:
    """The steps with the body as high and as turned as given ``(S + 1, 4)`` [m, rad]."""
    tilts = postures[:, 1:] - np.array([0.0, 0.0, steps.heading])
    return replace(
        steps, heights=postures[1:, 0], start_height=float(postures[0, 0]), tilts=tilts
    )  # fmt: skip
