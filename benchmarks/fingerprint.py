"""Do all planners still plan the same, to the last bit? ``python -m benchmarks.fingerprint``

Prints a line for each of some short walks: its duration, its phases, and a hash of all the bits of
its path and phases. An error is part of the fingerprint. ``--save FILE`` keeps the walks;
``--against FILE`` tells how far they are from those that were kept: exit code 1 when any is not
within 1e-9. Only public names of gaitopt are used, and sizes are given in numbers, so that the same
file runs beside older and newer planners. Bits are those of one machine and its libraries.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import gaitopt
from gaitopt import Footholds, GaitSchedule, Obstacle, Plan

Array = NDArray[np.float64]
Case = Callable[[], Plan]
SAMPLES = 200
CLOSE = 1e-9
"""Largest difference that counts as none [m], [rad], [s]."""

# --- the walks --------------------------------------------------------------------------------


class Size(NamedTuple):
    """Lengths that go with a robot, as numbers: defaults that change change nothing here."""

    scale: float
    length: float
    width: float
    body: float
    swing: float


SIZES = {
    "wang2020": Size(1.0, 0.40, 0.30, 0.40, 0.07),
    "wang2020-fast": Size(1.0, 0.40, 0.30, 0.40, 0.07),
    "a1": Size(0.629384, 0.361, 0.2616, 0.25, 0.044),
    "go1": Size(0.674904, 0.3762, 0.2535, 0.27, 0.047),
    "anymal_c": Size(1.112678, 0.7196, 0.60232, 0.44, 0.077),
    "solo12": Size(0.561404, 0.3892, 0.2939, 0.22, 0.038),
}
robot = cache(gaitopt.load_robot)


def columns(
    name: str, count: int = 3, seed: int = 3, turn: float = 0.0, rise: float = 0.0, **more: float
) -> Footholds:
    """S-shaped columns to a robot's size, each row ``rise`` higher, all turned about z."""
    scale, length, width = SIZES[name][:3]
    given = {"forward": 1.5 / 16 * scale * max(count - 1, 1), "jitter": 0.02 * scale, **more}
    flat = gaitopt.s_columns(
        seed, columns=count, amplitude=0.10 * scale, wavelength=1.5 * scale, body_length=length,
        body_width=width, diameter=0.04 * scale, **given,
    )  # fmt: skip
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    up = np.outer(np.arange(count), [0.0, 0.0, rise])
    return Footholds({leg: (flat[leg] + up) @ matrix for leg in gaitopt.LEGS}, flat.radius)


def crawl(name: str = "wang2020", over: Mapping[str, Any] | None = None, **more: Any) -> Case:
    """A crawl over columns; ``over`` are arguments of :func:`columns`."""
    size = SIZES[name]
    asked = dict(stability_margin=0.02, body_height=size.body, swing_height=size.swing) | more
    return lambda: gaitopt.plan_crawl(robot(name), columns(name, **over or {}), **asked)


def route(
    free: Any, name: str = "wang2020", over: Mapping[str, Any] | None = None, **more: Any
) -> Case:
    """A time-optimal crawl by ``plan_route``, which takes a clearance, too."""
    size = SIZES[name]
    asked = dict(stability_margin=0.02, body_height=size.body, swing_height=size.swing) | more
    asked = dict(free=free, clearance=0.02) | asked
    return lambda: gaitopt.plan_route(robot(name), columns(name, **over or {}), **asked)


def gait(name: str, schedule: GaitSchedule, velocity: Any, yaw_rate: float = 0.0,
         **more: Any) -> Case:  # fmt: skip
    """A gait by velocity, for a second at full speed."""
    body = SIZES[name].body
    asked = dict(yaw_rate=yaw_rate, duration=1.0, body_height=body, swing_height=0.15 * body) | more
    return lambda: gaitopt.plan_gait(robot(name), schedule, velocity, **asked)


def stride(name: str, obstacle: Obstacle, **more: Any) -> Case:
    """A walk over an obstacle, without cycles before and after it."""
    asked = dict(stability_margin=0.02, margin=0.03, clearance=0.01, approach=0, leave=0) | more
    return lambda: gaitopt.plan_stride(robot(name), obstacle, **asked)


ONE: dict[str, Any] = {"count": 2}
HARD = ONE | {"seed": 2, "forward": 0.35, "jitter": 0.08}
FAR = ONE | {"forward": 0.9}
BOARD, LOW = gaitopt.rectangular_obstacle(0.11, 0.04), gaitopt.rectangular_obstacle(0.06, 0.03)
LOG = gaitopt.round_obstacle(0.08, position=(1.0, -2.0, 0.3), yaw=0.7)
TABLE_I = {"acceleration_limit": np.radians(20.0), "jerk_limit": np.radians([40.0, 50.0])}
FROG = {"body_height": 0.72, "swing_height": 0.08}
TROT, WALK = gaitopt.trot(0.5), gaitopt.walk(1.6, 0.85)

CASES: dict[str, Case] = {
    "crawl distance": crawl(over={"count": 5}),
    "crawl margin": crawl(objective="margin"),
    "crawl speed": crawl(speed=0.05),
    "crawl cycloid": crawl(swing="cycloid"),
    "crawl parabola path": crawl(over={"height_jitter": 0.03}, swing="parabola path"),
    "crawl heading": crawl(over={"turn": 0.7}, heading=0.7),
    "crawl stairs": crawl(over={"rise": 0.04}, follow_terrain=True),
    "crawl cog_start": crawl(cog_start=(0.03, -0.02)),
    "crawl reach_fraction": crawl(reach_fraction=0.9, stability_margin=0.03),
    "crawl sequence": crawl(sequence=("LH", "LF", "RH", "RF")),
    "crawl order": crawl(sequence=("RH", "RF", "LH", "LF", "LH", "LF", "RH", "RF")),
    "crawl standing": crawl(over={"count": 1}),
    "crawl wang2020-fast": crawl("wang2020-fast", speed=2.0),
    "crawl a1": crawl("a1"),
    "crawl go1 margin": crawl("go1", objective="margin"),
    "crawl anymal_c": crawl("anymal_c", swing="half-ellipse"),
    "crawl solo12": crawl("solo12"),
    "free crawl": crawl(sequence="free"),
    "free crawl rescue": crawl(over=HARD, sequence="free", stability_margin=0.05),
    "free crawl a1": crawl("a1", over=ONE, sequence="free"),
    "time route": crawl(objective="time", free="route"),
    "time overlap": crawl(objective="time", free="overlap"),
    "time swing": crawl(objective="time"),
    "time height": crawl(objective="time", free="height", over={"turn": 0.7}, heading=0.7),
    "time posture": crawl(objective="time", free="posture"),
    "time dynamic": crawl(objective="time", free="dynamic", stability_margin=0.03),
    "time swing smooth": crawl(objective="time", acceleration_limit=6.0),
    "time overlap stops": crawl(objective="time", free="overlap", acceleration_limit=6.0),
    "time model": crawl(objective="time", com="model"),
    "time free": crawl(objective="time", free="route", over=ONE, sequence="free"),
    "route overlap+height": route({"height", "overlap"}, over={"height_jitter": 0.02}),
    "route knots": route("swing", over=ONE, stance_knots=3, swing_knots=10, clearance=0.04),
    "route stairs": route("swing", over={"rise": 0.04}, follow_terrain=True),
    "route cog_start": route("swing", over=ONE, cog_start=(0.0, 0.14), acceleration_limit=6.0),
    "route stops": route("route", over=ONE, acceleration_limit=6.0),
    "route posture smooth": route("posture", over=ONE, acceleration_limit=6.0),
    "route model posture": route("posture", over=ONE, com="model"),
    "route model overlap": route("overlap", com="model", horizon=4),
    "route horizon": route("swing", over={"count": 4}, horizon=4),
    "route dynamic horizon": route("dynamic", over={"count": 4}, horizon=4),
    "route standing": route("height", over={"count": 1}),
    "route wang2020-fast": route("height", "wang2020-fast"),
    "route a1": route("height", "a1"),
    "route a1 dynamic": route("dynamic", "a1", over=ONE, acceleration_limit=420.0),
    "route anymal_c model": route("height", "anymal_c", com="model"),
    "route go1": route("posture", "go1", over=ONE),
    "route free dynamic": route("dynamic", over=ONE, sequence="free"),
    "gait trot": gait("wang2020-fast", TROT, 0.3, swing="cycloid"),
    "gait trot turn": gait("wang2020-fast", TROT, (0.1, 0.0), 0.4, heading=0.5),
    "gait trot flight": gait("wang2020-fast", gaitopt.trot(0.5, 0.4), 0.1),
    "gait trot adapt": gait("wang2020-fast", TROT, 0.3, adapt=10.0),
    "gait walk": gait("wang2020-fast", WALK, (0.03, 0.03), -0.1),
    "gait walk stiff": gait("wang2020-fast", WALK, 0.08, sway=False, swing="box"),
    "gait pace go1": gait("go1", gaitopt.pace(0.5), 0.2),
    "gait quasi-static a1": gait("a1", gaitopt.quasi_static(1.0, 0.7), 0.1),
    "gait bound solo12": gait("solo12", gaitopt.bound(0.5), 0.1),
    "gait wave anymal_c": gait("anymal_c", gaitopt.wave(1.6), 0.05, acceleration_limit=1e3),
    "stride frog1 board": stride("frog1", BOARD, **FROG, **TABLE_I),
    "stride frog1 walk": stride("frog1", LOW, approach=1, leave=1, pattern="trapezoid", **FROG),
    "stride wang2020": stride("wang2020", LOW),
    "stride anymal_c log": stride("anymal_c", LOG, body_height=0.55, swing_height=0.06),
    "no crawl margin": crawl(stability_margin=0.25),
    "no crawl reach": crawl(over=FAR),
    "no crawl stairs": crawl(over={"count": 9, "rise": 0.04}),
    "no crawl cog_start": crawl(cog_start=(2.0, 0.0)),
    "no crawl swing": crawl(swing_height=0.33),
    "no crawl legs": crawl(over={"turn": 1.6}),
    "no free crawl": crawl(over=FAR, sequence="free"),
    "no time margin": crawl(objective="time", stability_margin=0.2),
    "no time iterations": route("swing", iterations=4),
    "no time model dynamic": route("dynamic", com="model"),
    "no gait speed": gait("wang2020-fast", TROT, (1.2, 0.2), 0.3),
    "no gait reach": gait("wang2020-fast", gaitopt.trot(4.0), 0.5),
    "no gait joints": gait("wang2020", TROT, 0.3),
    "no stride": stride("wang2020", gaitopt.rectangular_obstacle(0.05, 0.4), body_height=0.5),
}

# --- their fingerprints -----------------------------------------------------------------------


class Print(NamedTuple):
    """What is kept of a walk: its bits' hash, or an error and no walk.

    Attributes:
        bits: hash of the path's and the phases' bits, or of the error's words.
        error: type and words of the error; empty for a walk.
        times: equally spaced, the last one the duration ``(SAMPLES,)`` [s].
        q: configurations at these times ``(SAMPLES, nq)``.
        phases: start, duration and margin of each phase ``(P, 3)``.
    """

    bits: str
    error: str
    times: Array
    q: Array
    phases: Array

    def __str__(self) -> str:
        if self.error:
            return f"{self.error.split(':')[0]} {self.bits}"
        return f"{self.times[-1]:.17g} s {len(self.phases)} phases {self.bits}"


def taken(case: Case) -> Print:
    """The fingerprint of a walk, or of the error that its planner raises."""
    try:
        plan = case()
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        none = np.empty((0, 0))
        return Print(sha256(words.encode()).hexdigest()[:16], words, none, none, none)
    phases = np.array([(p.start, p.duration, p.margin) for p in plan.phases], dtype=np.float64)
    kept = [np.asarray(a, np.float64) for a in (plan.path.times, plan.path.coefficients, phases)]
    bits = sha256(b"".join(a.tobytes() for a in kept)).hexdigest()[:16]
    times = np.linspace(0.0, plan.duration, SAMPLES)
    return Print(bits, "", times, np.array(plan.at(times).q), phases.reshape(-1, 3))


def differences(one: Print, other: Print) -> tuple[float, float, float, float]:
    """Largest differences of configurations, duration, phases' times, and their margins."""
    if one.error or other.error or one.q.shape != other.q.shape:
        far = 0.0 if one.bits == other.bits else np.inf
        return far, far, far, far
    # Both signs of a quaternion are the same turn.
    flip = np.where((one.q[:, 3:7] * other.q[:, 3:7]).sum(axis=1) < 0.0, -1.0, 1.0)
    turned = other.q.copy()
    turned[:, 3:7] *= flip[:, None]
    return (
        apart(one.q, turned),
        apart(one.times[-1:], other.times[-1:]),
        apart(one.phases[:, :2], other.phases[:, :2]),
        apart(one.phases[:, 2], other.phases[:, 2]),
    )


def apart(one: Array, other: Array) -> float:
    """Largest absolute difference; infinite where shapes or numbers that are not finite differ."""
    if one.shape != other.shape:
        return float("inf")
    with np.errstate(invalid="ignore"):
        gaps = np.where(one == other, 0.0, np.abs(one - other))
    return float(np.nan_to_num(gaps, nan=np.inf).max(initial=0.0))


# --- the command ------------------------------------------------------------------------------


def save(path: Path, found: Mapping[str, Print]) -> None:
    """Keep fingerprints in an ``.npz`` file."""
    with path.open("wb") as stream:
        arrays = {f"{n}|{k}": v for n, p in found.items() for k, v in p._asdict().items()}
        np.savez_compressed(stream, **arrays)


def load(path: Path) -> dict[str, Print]:
    """The fingerprints that :func:`save` kept."""
    with np.load(path, allow_pickle=False) as kept:
        names = dict.fromkeys(key.rsplit("|", 1)[0] for key in kept.files)
        return {n: Print(str(kept[f"{n}|bits"]), str(kept[f"{n}|error"]),
                         *(kept[f"{n}|{k}"] for k in Print._fields[2:])) for n in names}  # fmt: skip


def compared(found: Mapping[str, Print], known: Mapping[str, Print]) -> int:
    """Print each walk's differences and what they come to; the exit code."""
    equal, far = 0, []
    for name in dict.fromkeys([*found, *known]):
        if name not in found or name not in known:
            print(f"{name:24} only {'here' if name in found else 'in the file'}")
            far.append(name)
            continue
        one, other = found[name], known[name]
        gaps = differences(one, other)
        same = one.bits == other.bits
        equal += same
        if max(gaps) > CLOSE:
            far.append(name)
        told = "q {:.3g} duration {:.3g} phases {:.3g} margins {:.3g}".format(*gaps)
        print(f"{name:24} {'equal' if same else told}")
        if one.error != other.error:
            print(f"    was {other.error or other}\n    now {one.error or one}")
    print(f"{equal} equal to the last bit, {len({*found, *known}) - len(far)} within {CLOSE:g}, "
          f"not so: {', '.join(far) or 'none'}")  # fmt: skip
    return int(bool(far))


def main(arguments: Sequence[str] | None = None) -> int:
    """Take the fingerprints, print them, keep or compare them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fingerprint", description=__doc__)
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep the walks in an .npz file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with walks kept")
    parser.add_argument("--only", default="", metavar="SUBSTRING", help="walks with such names")
    options = parser.parse_args(arguments)
    known = load(options.against) if options.against else {}
    known = {name: one for name, one in known.items() if options.only in name}
    began, found = time.perf_counter(), {}
    for name, case in CASES.items():
        if options.only in name:
            found[name] = taken(case)
            print(f"{name:24} {found[name]}", flush=True)
    print(f"{len(found)} walks in {time.perf_counter() - began:.0f} s", file=sys.stderr)
    if options.save:
        save(options.save, found)
    return compared(found, known) if options.against else 0


if __name__ == "__main__":
    sys.exit(main())
