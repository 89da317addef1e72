"""What a trajectory controller makes of exported plans: peak velocities and joint errors.

``python -m benchmarks.physics.exports``

The files are read back and interpolated by scipy as the controller does (straight lines, cubics,
quintics), at 40 places between any two points. Beside them: samples of the plan at 10 ms with the
plan's velocities, which is what one would write without looking at the controller.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly

import gaitopt
from gaitopt.conventions import FloatArray
from gaitopt.exporting.at_rest import at_rest
from gaitopt.plan.plan import Plan

FIELDS = {"linear": 1, "cubic": 2, "quintic": 3}
"""How many of positions, velocities and accelerations the points have."""
PLACES = 40


def plans() -> dict[str, Plan]:
    """Walks of each kind, by name."""
    a1, go2, paper = (gaitopt.load_robot(name) for name in ("a1", "go2", "wang2020"))
    return {
        "crawl of a1, timing forces": gaitopt.plan_crawl(a1, gaitopt.s_columns(0, robot=a1)),
        "crawl of wang2020, timing velocity": gaitopt.plan_crawl(
            paper, gaitopt.s_columns(0), timing="velocity"
        ),
        "trot of go2": gaitopt.plan_gait(
            go2, gaitopt.trot(0.5, 0.4), velocity=0.5, ramp=0.4, duration=1.0
        ),
    }


def interpolated(
    times: FloatArray, values: list[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, positions and velocities between the points, as the controller has them."""
    curve = BPoly.from_derivatives(times, np.stack(values, axis=1))
    share = np.linspace(0.0, 1.0, PLACES + 2)[1:-1]
    inside = (times[:-1, None] + share * np.diff(times)[:, None]).ravel()
    return inside, np.asarray(curve(inside)), np.asarray(curve(inside, 1))


def judged(plan: Plan, times: FloatArray, values: list[FloatArray]) -> tuple[float, float]:
    """Largest share of a velocity limit [%], and largest joint error [mrad]."""
    inside, positions, velocities = interpolated(times, values)
    there = plan.at(np.clip(inside, 0.0, plan.duration)).q[:, 7:]
    peak = (np.abs(velocities) / plan.robot.velocity_limits).max()
    return 100.0 * float(peak), 1e3 * float(np.abs(positions - there).max())


def exported(plan: Plan, kind: str) -> tuple[FloatArray, list[FloatArray]]:
    """Times and values of the points in the file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.json"
        gaitopt.export(plan, path, interpolation=kind, offset=0.0)
        points = json.loads(path.read_text())["points"]
    stamps = [p["time_from_start"] for p in points]
    names = ("positions", "velocities", "accelerations")[: FIELDS[kind]]
    times = np.array([s["sec"] + 1e-9 * s["nanosec"] for s in stamps])
    return times, [np.array([p[name] for p in points]) for name in names]


def main() -> None:
    """Print the table."""
    print("| plan | points | number | peak velocity [% of the limit] | joint error [mrad] |")
    print("|---|---|---|---|---|")
    for name, plan in plans().items():
        motion = plan.sample(0.01)
        naive = [motion.q[:, 7:], motion.v[:, 6:]]
        rows = [("every 10 ms, with velocities", motion.t, naive, plan)]
        for kind in FIELDS:
            rows.append((f"exported, {kind}", *exported(plan, kind), at_rest(plan)))
        for what, times, values, judge in rows:
            peak, error = judged(judge, times, values)
            print(f"| {name} | {what} | {len(times)} | {peak:.1f} | {error:.2f} |")


if __name__ == "__main__":
    main()
