"""Do all planners still plan the same, to the last bit?

``python -m benchmarks.planning.fingerprint``

Prints a line for each of some short walks: its duration, how many phases, and a hash of all the
bits of path and phases; or its error. ``--save FILE`` keeps the walks, ``--against FILE`` tells how
far they are from those kept: exit code 1 when any is not within 1e-9. Only public names are used,
and sizes are given in numbers, so that the same file runs beside older and newer planners. Bits are
those of one machine and its libraries.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import gaitopt

Array = NDArray[np.float64]
Case = Callable[[], gaitopt.Plan]
SAMPLES, CLOSE = 200, 1e-9  # the latter, the largest difference that counts as none [m, rad, s]
NONE: Array = np.empty((0, 0))

SIZES = {
    "wang2020": (1.0, 0.40, 0.30, 0.40, 0.07),
    "wang2020-fast": (1.0, 0.40, 0.30, 0.40, 0.07),
    "a1": (0.629384, 0.361, 0.2616, 0.25, 0.044),
    "go1": (0.674904, 0.3762, 0.2535, 0.27, 0.047),
    "anymal_c": (1.112678, 0.7196, 0.60232, 0.44, 0.077),
    "solo12": (0.561404, 0.3892, 0.2939, 0.22, 0.038),
}
"""Scale of its terrain, length and width of its stance, height of body and swing of each robot."""
robot = cache(gaitopt.load_robot)


def columns(
    name: str, count: int = 3, step: float = 1.5 / 16, jitter: float = 0.02, rough: float = 0.0,
    rise: float = 0.0, turn: float = 0.0, seed: int = 3,
) -> gaitopt.Footholds:  # fmt: skip
    """S-shaped columns to a robot's size, each row ``rise`` higher, all turned about z."""
    scale, length, width, _, _ = SIZES[name]
    flat = gaitopt.s_columns(
        seed, columns=count, forward=scale * step * max(count - 1, 1), jitter=scale * jitter,
        height_jitter=scale * rough, amplitude=0.10 * scale, wavelength=1.5 * scale,
        diameter=0.04 * scale, body_length=length, body_width=width,
    )  # fmt: skip
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    up = np.outer(np.arange(count), [0.0, 0.0, rise])
    return gaitopt.Footholds({leg: (flat[leg] + up) @ matrix for leg in gaitopt.LEGS}, flat.radius)


def crawl(name: str = "wang2020", over: Mapping[str, Any] = {}, **more: Any) -> Case:
    """A crawl over columns; ``over`` are arguments of :func:`columns`."""
    *_, body, swing = SIZES[name]
    given = {"stability_margin": 0.02, "body_height": body, "swing_height": swing,
             "timing": "velocity", **more}  # fmt: skip
    planner = given.pop("planner", gaitopt.plan_crawl)
    return lambda: planner(robot(name), columns(name, **over), **given)


def gait(name: str, schedule: Any, velocity: Any, yaw_rate: float = 0.0, **more: Any) -> Case:
    """A gait by velocity, for a second at full speed."""
    *_, body, swing = SIZES[name]
    given = {"duration": 1.0, "body_height": body, "swing_height": swing, **more}
    return lambda: gaitopt.plan_gait(
        robot(name), schedule, velocity=velocity, yaw_rate=yaw_rate, timing="velocity", **given
    )


def stride(name: str, obstacle: Any, **more: Any) -> Case:
    """A walk over an obstacle, with a cycle before it and one after it."""
    given = {
        "stability_margin": 0.02, "margin": 0.03, "clearance": 0.01, "timing": "velocity", **more,
    }  # fmt: skip
    return lambda: gaitopt.plan_stride(robot(name), obstacle, **given)


fastest = partial(crawl, objective="time")
route = partial(crawl, planner=gaitopt.plan_route, clearance=0.02)
fast = partial(gait, "wang2020-fast")
trot, box = gaitopt.trot(0.5), gaitopt.rectangular_obstacle
log = gaitopt.round_obstacle(0.08, position=(1.0, -2.0, 0.3), yaw=0.7)
ONE, FOUR, TURNED, ROUGH = {"count": 2}, {"count": 4}, {"turn": 0.7}, {"rough": 0.03}
HARD, FAR = {**ONE, "seed": 2, "step": 0.35, "jitter": 0.08}, {**ONE, "step": 0.9}
FROG = {"body_height": 0.72, "swing_height": 0.08}
TABLE_I = {"acceleration_limit": np.radians(20.0), "jerk_limit": np.radians([40.0, 50.0])}

CASES: dict[str, Case] = {
    **{f"crawl {name}": crawl(name) for name in SIZES},
    "crawl margin": crawl(objective="margin", over={"count": 9}),
    "crawl speed": crawl(speed=0.05),
    **{f"crawl {swing}": crawl(swing=swing, over=ROUGH) for swing in ("cycloid", "parabola path")},
    "crawl heading": crawl(heading=0.7, over=TURNED),
    "crawl stairs": crawl(follow_terrain=True, over={"rise": 0.04}),
    "crawl cog_start": crawl(cog_start=(0.03, -0.02)),
    "crawl reach_fraction": crawl(reach_fraction=0.73, stability_margin=0.04),
    "crawl sequence": crawl(sequence=("LH", "LF", "RH", "RF")),
    "crawl order": crawl(sequence=("RH", "RF", "LH", "LF", "LH", "LF", "RH", "RF")),
    "crawl standing": crawl(over={"count": 1}),
    "free crawl": crawl(sequence="free"),
    "free crawl rescue": crawl(sequence="free", stability_margin=0.05, over=HARD),
    "free crawl a1": crawl("a1", sequence="free", over=ONE),
    **{f"time {row}": fastest(free=row, over=FOUR)
       for row in ("route", "overlap", "swing", "height", "posture", "dynamic")},
    **{f"time {row} smooth": fastest(free=row, acceleration_limit=6.0, over=ROUGH)
       for row in ("route", "overlap", "swing", "posture")},
    **{f"time {row} model": fastest(free=row, com="model", heading=0.7, over=TURNED)
       for row in ("route", "swing", "posture")},
    **{f"time {row} horizon": fastest(free=row, horizon=6, over={"count": 5})
       for row in ("overlap", "height", "dynamic")},
    "time model horizon": fastest(com="model", horizon=6, over=FOUR),
    "time free dynamic": fastest(free="dynamic", sequence="free", over=ONE),
    **{f"route height {name}": route(name, free="height") for name in SIZES},
    "route overlap+height": route(free={"height", "overlap"}, over=ROUGH),
    "route knots": route(clearance=0.05, stance_knots=3, swing_knots=10, over=ROUGH),
    "route stairs": route(free="posture", follow_terrain=True, over={"rise": 0.04}),
    "route cog_start": route(cog_start=(0.0, 0.14), acceleration_limit=6.0, over={"seed": 0}),
    "route dynamic a1": route("a1", free="dynamic", acceleration_limit=420.0, over=ONE),
    "route model anymal_c": route("anymal_c", free="height", com="model"),
    "gait trot": fast(trot, 0.3, swing="cycloid"),
    "gait trot turn": fast(trot, (0.1, 0.05), 0.4, heading=0.5),
    "gait trot flight": fast(gaitopt.trot(0.5, 0.4), 0.1),
    "gait trot adapt": fast(trot, 0.3, adapt=10.0),
    "gait walk": fast(gaitopt.walk(1.6, 0.85), (0.03, 0.03), -0.1),
    "gait pace go1": gait("go1", gaitopt.pace(0.5), 0.2),
    "gait quasi-static a1": gait("a1", gaitopt.quasi_static(1.0, 0.7), 0.1),
    "gait bound solo12": gait("solo12", gaitopt.bound(0.5), 0.1),
    "gait wave anymal_c": gait("anymal_c", gaitopt.wave(1.6), 0.05, acceleration_limit=1e3),
    "stride frog1": stride("frog1", box(0.11, 0.04), **FROG, **TABLE_I),
    "stride frog1 trapezoid": stride("frog1", box(0.06, 0.03), pattern="trapezoid", **FROG),
    "stride wang2020": stride("wang2020", box(0.06, 0.03)),
    "stride anymal_c": stride("anymal_c", log, body_height=0.57, swing_height=0.06, leave=0),
    "no crawl margin": crawl(stability_margin=0.25),
    "no crawl stairs": crawl(over={"count": 17, "rise": 0.04}),
    "no crawl cog_start": crawl(cog_start=(2.0, 0.0)),
    "no crawl swing": crawl(swing_height=0.33),
    "no free crawl": crawl(sequence="free", over=FAR),
    "no route iterations": route(iterations=4),
    "no route cog_start": route(cog_start=(0.0, 0.14), acceleration_limit=6.0),
    "no time model dynamic": fastest(free="dynamic", com="model"),
    "no gait speed": fast(trot, (1.2, 0.2), 0.3),
    "no gait reach": fast(gaitopt.trot(4.0), 0.5),
    "no stride": stride("wang2020", box(0.05, 0.4), body_height=0.5),
}  # fmt: skip


class Print(NamedTuple):
    """A walk's hash, times, ``q`` at each, and phases' start, duration and margin; or an error."""

    bits: str
    error: str
    times: Array = NONE
    q: Array = NONE
    phases: Array = NONE

    def __str__(self) -> str:
        kind = self.error.split(":")[0]
        return f"{kind or f'{self.times[-1]:.17g} s {len(self.phases)} phases'} {self.bits}"


def taken(case: Case) -> Print:
    """The fingerprint of a walk, or of the error that its planner raises."""
    try:
        plan = case()
        times = np.linspace(0.0, plan.duration, SAMPLES)
        q = plan.at(times).q
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        return Print(sha256(words.encode()).hexdigest()[:16], words)
    phases = np.array([(p.start, p.duration, p.margin) for p in plan.phases]).reshape(-1, 3)
    bits = b"".join(a.tobytes() for a in (plan.path.times, plan.path.coefficients, phases))
    return Print(sha256(bits).hexdigest()[:16], "", times, q, phases)


def differences(one: Print, other: Print) -> tuple[float, ...]:
    """Largest difference of configurations, duration, phases' times, and phases' margins.

    Errors of the same class count as the same: their words may be put better.
    """
    if one.error or other.error or one.q.shape != other.q.shape:
        kinds = [found.error.split(":")[0] for found in (one, other)]
        same = one.bits == other.bits or (kinds[0] == kinds[1] != "")
        return (0.0 if same else np.inf,) * 4
    # Both signs of a quaternion are the same turn.
    q, turn = other.q.copy(), (one.q[:, 3:7] * other.q[:, 3:7]).sum(axis=1, keepdims=True)
    q[:, 3:7] *= np.where(turn < 0.0, -1.0, 1.0)
    ours = (one.q, one.times[-1:], one.phases[:, :2], one.phases[:, 2])
    theirs = (q, other.times[-1:], other.phases[:, :2], other.phases[:, 2])
    return tuple(map(apart, ours, theirs))


def apart(one: Array, other: Array) -> float:
    """Largest absolute difference; infinite where shapes differ, or infinite numbers."""
    if one.shape != other.shape:
        return float("inf")
    gaps = np.subtract(one, other, where=one != other, out=np.zeros(one.shape))
    return float(np.abs(gaps).max(initial=0.0))


def save(path: Path, found: Mapping[str, Print]) -> None:
    """Keep fingerprints in an ``.npz`` file."""
    arrays = {f"{name}|{k}": v for name, one in found.items() for k, v in one._asdict().items()}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def load(path: Path, only: str = "") -> dict[str, Print]:
    """The fingerprints that :func:`save` kept, of walks that are so named."""
    with np.load(path) as kept:
        parts = {key: a if a.ndim else a.item() for key, a in kept.items()}
    names = dict.fromkeys(key.split("|")[0] for key in parts if only in key.split("|")[0])
    return {name: Print(*(parts[f"{name}|{k}"] for k in Print._fields)) for name in names}


def compare(found: Mapping[str, Print], known: Mapping[str, Print]) -> int:
    """Print each walk's differences and what they come to; the exit code."""
    equal, far, missing = 0, [], Print("", "not there")
    for name in (names := dict.fromkeys([*found, *known])):
        one, other = found.get(name, missing), known.get(name, missing)
        gaps, same = differences(one, other), one.bits == other.bits
        equal += same
        far += [] if max(gaps) <= CLOSE else [name]
        told = "q {:.2g} duration {:.2g} phases {:.2g} margins {:.2g}".format(*gaps)
        print(f"{name:28} {told}{' equal' if same else ''}")
        if one.error != other.error:
            print(f"  was {other.error or other}\n  now {one.error or one}")
    print(f"of {len(names)} {equal} equal to the last bit, {len(names) - len(far)} within {CLOSE:g}"
          f"; not within: {', '.join(far) or 'none'}")  # fmt: skip
    return int(bool(far))


def main(arguments: Sequence[str] | None = None) -> int:
    """Take the fingerprints, print them, keep or compare them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.fingerprint", description=__doc__
    )
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep the walks in an .npz file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with those kept")
    parser.add_argument("--only", default="", metavar="SUBSTRING", help="walks so named")
    options = parser.parse_args(arguments)
    known = load(options.against, options.only) if options.against else {}
    began, found = time.perf_counter(), {}
    for name in (name for name in CASES if options.only in name):
        found[name] = taken(CASES[name])
        print(f"{name:28} {found[name]}", flush=True)
    print(f"{len(found)} walks in {time.perf_counter() - began:.0f} s", file=sys.stderr)
    if options.save:
        save(options.save, found)
    return compare(found, known) if options.against else 0


if __name__ == "__main__":
    sys.exit(main())
