"""The phases of a gait: stretches of constant support, with their margins."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.planning.gait_motion import GaitMotion
from gaitopt.planning.path import MotionPath
from gaitopt.planning.phase import Phase
from gaitopt.stability.contacts import support_margin
from gaitopt.stability.zmp import cart_table_zmp

SAMPLES = 65
"""Samples a phase for its margins, both ends included."""


def gait_phases(
    motion: GaitMotion, path: MotionPath
) -> tuple[tuple[Phase, ...], dict[str, float | str]]:
    """The phases, and what a plan says of its balance (see :func:`gaitopt.plan_gait`)."""
    edges = _edges(motion, path)
    times = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    middles = (edges[1:] + edges[:-1]) / 2.0
    standing = contacts_at(motion.events, middles)
    flat = times.ravel()
    contacts = np.repeat(standing, SAMPLES, axis=0)
    feet = motion.feet(flat)[0]
    place, _, change = motion.centre(flat)
    height = motion.height + motion.robot.foot_radius
    static = support_margin(feet, contacts, place).reshape(times.shape)
    moving = support_margin(feet, contacts, _zmp(place, change, height)).reshape(times.shape)
    centres = np.column_stack([motion.centre(edges)[0], np.full(len(edges), motion.height)])
    lasting = np.diff(edges)
    flight = ~standing.any(axis=1)
    worst = float(np.nanmin(moving)) if not flight.all() else float("-inf")
    if motion.sway is not None:
        # The ZMP of a cubic spline has its corners at the spline's own knots.
        for side in (-1e-9, 1e-9):
            knots = np.clip(motion.sway.times + side, 0.0, motion.duration)
            worst = float(np.fmin(worst, smallest_zmp_margin(motion, knots)))
    info: dict[str, float | str] = {
        "stability": "ZMP of the body centre as a point mass",
        "zmp_margin": worst,
        "flight": float(lasting[flight].sum() / lasting.sum()),
    }
    margins = np.where(flight, -np.inf, np.nan_to_num(static, nan=-np.inf).min(axis=1))
    phases = tuple(
        _phase(motion, k, edges, standing[k], centres, float(margins[k]))
        for k in range(len(middles))
    )
    return phases, info


def contacts_at(events: tuple[SwingEvent, ...], times: FloatArray) -> BoolArray:
    """Which feet stand at ``times (N,)``: ``(N, 4)``."""
    standing = np.ones((len(times), len(LEGS)), dtype=np.bool_)
    for event in events:
        inside = (times > event.lift_off) & (times < event.touch_down)
        standing[inside, LEGS.index(event.leg)] = False
    return standing


def smallest_zmp_margin(motion: GaitMotion, times: FloatArray) -> float:
    """Smallest margin of the centre's ZMP at ``times (N,)`` [m]; NaN where no foot stands."""
    standing = contacts_at(motion.events, times)
    place, _, change = motion.centre(times)
    zmp = _zmp(place, change, motion.height + motion.robot.foot_radius)
    margins = support_margin(motion.feet(times)[0], standing, zmp)
    return float(np.nanmin(margins)) if standing.any() else float("nan")


def _zmp(place: FloatArray, change: FloatArray, height: float) -> FloatArray:
    return cart_table_zmp(np.column_stack([place, np.full(len(place), height)]), change)


def _edges(motion: GaitMotion, path: MotionPath) -> FloatArray:
    """Instants at which the support changes, as knots of the path ``(P + 1,)``."""
    wanted = np.array(
        [0.0, motion.duration, *(t for e in motion.events for t in (e.lift_off, e.touch_down))]
    )
    # Lift-offs and touch-downs that are the same instant may differ in their last bits.
    nearest = np.abs(path.times[:, None] - wanted[None]).argmin(axis=0)
    return np.asarray(path.times[np.unique(nearest)])


def _phase(
    motion: GaitMotion,
    k: int,
    edges: FloatArray,
    standing: BoolArray,
    centres: FloatArray,
    margin: float,
) -> Phase:
    start, end = float(edges[k]), float(edges[k + 1])
    support = tuple(leg for leg, stands in zip(LEGS, standing, strict=True) if stands)
    flying: list[tuple[int, SwingEvent | None]] = [
        (i, e) for i, e in enumerate(motion.events)
        if e.leg not in support and e.lift_off < end - 1e-9 and e.touch_down > start + 1e-9
    ]  # fmt: skip
    later: list[tuple[int, SwingEvent | None]] = [
        (i, e) for i, e in enumerate(motion.events) if e.lift_off > start - 1e-9
    ]
    step, event = (flying or later or [(len(motion.events), None)])[0]
    kind = "swing" if flying else "stance"
    leg = "" if event is None else event.leg
    points = motion.footholds[leg or LEGS[0]]
    at = 0 if event is None else event.step
    ends = (points[at], points[at + 1]) if flying else (points[at], points[at])
    if event is None:
        ends = (points[-1], points[-1])
    return Phase(
        kind, leg, step, start, end - start, centres[k], centres[k + 1], support,  # type: ignore[arg-type]
        ends[0], ends[1], margin,
    )  # fmt: skip
