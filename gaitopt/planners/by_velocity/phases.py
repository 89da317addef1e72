"""The phases of a gait: intervals of time in which the same feet stand, with their margins."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.plan.phase import Phase
from gaitopt.plan.record import GaitRecord
from gaitopt.planners.by_velocity.contacts import contacts_at, flights_at, support_changes
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.reaction import whole_zmp
from gaitopt.stability.contacts import support_margin
from gaitopt.stability.zmp import cart_table_zmp

SAMPLES = 65
"""Samples of each phase for its margins, both ends included; chosen here."""
INWARD = 1e-9
"""Share of a phase by which samples at its ends lie inside it."""
BESIDE = 1e-9
"""How far beside a knot of the sway the ZMP is taken, on either side [s]: it may have a corner."""


def gait_phases(
    motion: GaitMotion, path: MotionPath, *, whole_robot: bool = False
) -> tuple[tuple[Phase, ...], GaitRecord]:
    """The phases, and what a plan says of its balance (see :func:`gaitopt.plan_gait`).

    Args:
        motion: the gait.
        path: of the motion.
        whole_robot: whether margins are those of the whole robot's ZMP. Otherwise those of phases
            are static, and that of the record is the one of the body centre's ZMP.
    """
    edges = _edges(motion, path)
    shares = np.linspace(0.0, 1.0, SAMPLES)
    # Accelerations may jump at the ends of a phase.
    inside = np.clip(shares, INWARD, 1.0 - INWARD) if whole_robot else shares
    times = edges[:-1, None] + np.diff(edges)[:, None] * inside
    flights = flights_at(motion.events, (edges[1:] + edges[:-1]) / 2.0)
    standing = flights < 0
    flat = times.ravel()
    contacts = np.repeat(standing, SAMPLES, axis=0)
    feet = motion.feet(flat)[0]
    place, _, acceleration = motion.centre(flat)
    if whole_robot:
        zmp = whole_zmp(motion, flat)
    else:
        zmp = _zmp(place, acceleration, motion.height + motion.robot.foot_radius)
    moving = support_margin(feet, contacts, zmp).reshape(times.shape)
    static = moving if whole_robot else support_margin(feet, contacts, place).reshape(times.shape)
    lasting = np.diff(edges)
    flight = ~standing.any(axis=1)
    worst = float(np.nanmin(moving)) if not flight.all() else float("-inf")
    if motion.sway is not None and not whole_robot:
        # The ZMP of a cubic spline has corners at the spline's knots.
        for side in (-BESIDE, BESIDE):
            knots = np.clip(motion.sway.times + side, 0.0, motion.duration)
            worst = float(np.fmin(worst, smallest_zmp_margin(motion, knots)))
    record = GaitRecord(
        stability="contact forces, and the ZMP of the whole robot" if whole_robot else
        "ZMP of the body centre as a point mass",
        zmp_margin=worst,
        flight=float(lasting[flight].sum() / lasting.sum()),
    )  # fmt: skip
    margins = np.where(flight, -np.inf, np.nan_to_num(static, nan=-np.inf).min(axis=1))
    return _phases(motion, edges, flights, margins), record


def smallest_zmp_margin(motion: GaitMotion, times: FloatArray) -> float:
    """Smallest margin of the ZMP at ``times (N,)`` [m]; NaN when no foot stands at any of them."""
    standing = contacts_at(motion.events, times)
    place, _, acceleration = motion.centre(times)
    zmp = _zmp(place, acceleration, motion.height + motion.robot.foot_radius)
    if motion.is_free:
        zmp = whole_zmp(motion, times)
    margins = support_margin(motion.feet(times)[0], standing, zmp)
    return float(np.nanmin(margins)) if standing.any() else float("nan")


def _zmp(place: FloatArray, acceleration: FloatArray, height: float) -> FloatArray:
    """ZMP ``(N, 2)`` [m] of the body's centre, a point mass at a constant height."""
    return cart_table_zmp(np.column_stack([place, np.full(len(place), height)]), acceleration)


def _edges(motion: GaitMotion, path: MotionPath) -> FloatArray:
    """Knots of the path at which the support changes ``(P + 1,)`` [s]."""
    wanted = support_changes(motion.events, motion.duration)
    # The nearest knot of each: equal instants may differ in their last bits.
    later = np.clip(np.searchsorted(path.times, wanted), 1, len(path.times) - 1)
    nearer = wanted - path.times[later - 1] <= path.times[later] - wanted
    return np.asarray(path.times[np.unique(later - nearer)])


def _phases(
    motion: GaitMotion, edges: FloatArray, flights: np.ndarray, margins: FloatArray
) -> tuple[Phase, ...]:
    """The phases between ``edges``.

    A phase belongs to the first of the swings during it, or to the next swing when all feet stand.

    Args:
        motion: the gait.
        edges: ends of the phases ``(P + 1,)`` [s].
        flights: index of the swing in which each foot is ``(P, 4)``, or -1.
        margins: those of the phases ``(P,)`` [m].
    """
    centres = motion.centre_places(edges)
    lifts = [event.lift_off for event in motion.events]
    flies = flights.max(axis=1) >= 0
    on = np.where(flights >= 0, flights, len(lifts)).min(axis=1)
    coming = np.searchsorted(lifts, edges[:-1] - 1e-9, side="right")
    phases = []
    for k, index in enumerate(np.where(flies, on, coming).tolist()):
        leg, start, end = _owner(motion, index, bool(flies[k]))
        phases.append(Phase(
            "swing" if flies[k] else "stance", leg, index, float(edges[k]),
            float(edges[k + 1] - edges[k]), centres[k], centres[k + 1],
            tuple(name for name, at in zip(LEGS, flights[k], strict=True) if at < 0),
            start, end, float(margins[k]),
        ))  # fmt: skip
    return tuple(phases)


def _owner(motion: GaitMotion, index: int, flying: bool) -> tuple[str, FloatArray, FloatArray]:
    """The leg of a swing, and its foot's places at both ends of a phase that belongs to it."""
    if index == len(motion.events):
        last = motion.footholds[LEGS[0]][-1]
        return "", last, last
    event = motion.events[index]
    points = motion.footholds[event.leg]
    return event.leg, points[event.step], points[event.step + flying]
