"""The result of a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.conventions import ByValue, FloatArray, TextEnum
from gaitopt.plan.trajectory import Trajectory
from gaitopt.simulation.settings import SimulationSettings


class SimulationStatus(TextEnum):
    """How a simulation ended. Members equal their texts: ``result.status == "fell"``."""

    FINISHED = "finished"
    """The robot was on its feet until the end of the plan."""
    FELL = "fell"
    """The body tilted too far, or went too far from the plan."""
    DIVERGED = "diverged"
    """Positions or velocities are no sensible numbers any more; it counts as a fall. Try a smaller
    ``timestep``, or softer gains."""


LIGHT = (
    "no inertia of its motors is known, which slows light joints: load the robot with "
    "motor_inertia= in kg m^2 (--motor-inertia)"
)
"""What may help where a joint is too fast, or a foot that stood lost its foothold: feet of light
legs jump where the ground gives way."""


class MissReason(TextEnum):
    """Why a foothold counts as missed. Members equal their texts."""

    NO_CONTACT = "no contact"
    """Nothing was under the foot."""
    BESIDE = "beside"
    """The foot stood on something else, or farther away than the footholds' landing radius: on a
    height map also higher or lower than that."""
    LEFT = "left"
    """The foot stood, and was away before its next swing."""
    NEVER_REACHED = "never reached"
    """The simulation ended before the step was done."""

    @property
    def words(self) -> str:
        """The same in a few words."""
        told = {"no contact": "found no ground", "beside": "stood beside its foothold",
                "left": "left its foothold before its next swing",
                "never reached": "never reached its foothold"}  # fmt: skip
        return told[self.value]


@dataclass(frozen=True)
class MissedFoothold:
    """A foot that did not stand where the plan has it.

    Attributes:
        step: index of the step, from 0 over the whole walk.
        leg: the leg.
        distance: how far the foot was from its foothold [m]: horizontally; on a height map in
            space; where it was never reached horizontally at the end.
        reason: why it counts as missed.
    """

    step: int
    leg: str
    distance: float
    reason: MissReason


@dataclass(frozen=True, eq=False)
class SimulationResult(ByValue):
    """A plan's walk in physics.

    Attributes:
        status: how it ended.
        end: when it ended [s]: some time after the plan's end, or with the fall.
        waited: how long the plan's clock stood still [s], because a foot had yet to find the ground
            or to take up its load before another might lift off.
        steps_done: steps whose touch-down came before the end.
        steps: steps of the plan.
        missed: footholds that were missed, with those that were never reached.
        landing_error: largest horizontal distance of a foot from its foothold when it landed [m].
        landing_errors: of each step ``(steps,)`` [m]; NaN for steps that were not done.
        tilt: largest angle between the body's orientation and the plan's [rad].
        body_error: largest distance between the body's position and the plan's [m].
        com_margin: static stability margin of the true COM over the feet that the plan has
            standing, where they really are, at the times of ``motion`` ``(N,)`` [m]; NaN where
            the plan has fewer than three.
        smallest_margin: the smallest of it [m].
        slip: largest horizontal distance of a standing foot from where it landed [m]; its ball
            may have rolled there.
        peak_torques, peak_rates: of every joint over all steps of the physics ``(nj,)`` [N m],
            [rad/s].
        torque_use, rate_use: the largest of them as shares of the URDF's limits.
        servo_tolerance: by how much ``rate_use`` may exceed 1.
        known_motors: whether the inertia of the robot's motors is known.
        doubts: what loading the robot warns of its motors and joints: why physics may fail.
        energy: mechanical work done by the joints [J]; energy from braking is not recovered.
        own_shapes: whether the shapes of the robot's own MJCF touched the ground and one another;
            otherwise its feet were balls, and limbs and trunk touched the ground
            (``settings.limbs``).
        bumps: links that touched something with what is no foot. They fail no walk by themselves.
        wall_time, cpu_time: time that the simulation took, and time that the processor spent on it
            [s]. No other values differ from run to run.
        simulated_time: time simulated [s].
        motion: the simulated motion; ``gaitopt.replay(plan, path, simulated=result)`` shows it.
        plan_times: the plan's time at the samples of ``motion`` ``(N,)`` [s]. It stands still
            while the controller waits for a foot.
        torques: of the joints at these samples ``(N, nj)`` [N m].
        forces: of the ground on the feet, in the world's axes ``(N, 4, 3)`` [N].
        gains: of the controller and the servos.
        settings: what was asked for.
    """

    status: SimulationStatus
    end: float
    waited: float
    steps_done: int
    steps: int
    missed: tuple[MissedFoothold, ...]
    landing_error: float
    landing_errors: FloatArray
    tilt: float
    body_error: float
    com_margin: FloatArray
    smallest_margin: float
    slip: float
    peak_torques: FloatArray
    peak_rates: FloatArray
    torque_use: float
    rate_use: float
    servo_tolerance: float
    known_motors: bool
    doubts: tuple[str, ...]
    energy: float
    own_shapes: bool
    bumps: tuple[str, ...]
    wall_time: float = field(compare=False)
    cpu_time: float = field(compare=False)
    simulated_time: float
    motion: Trajectory
    plan_times: FloatArray
    torques: FloatArray
    forces: FloatArray
    gains: ControlGains
    settings: SimulationSettings

    @property
    def finished(self) -> bool:
        """Whether the robot was still on its feet at the end of the plan."""
        return self.status is SimulationStatus.FINISHED

    @property
    def succeeded(self) -> bool:
        """Finished, with every foot on its foothold."""
        return self.finished and not self.missed and self.steps_done == self.steps

    @property
    def rates_within(self) -> bool:
        """Whether joint velocities kept their limits within the servos' tolerance."""
        return self.rate_use <= 1.0 + self.servo_tolerance

    @property
    def passed(self) -> bool:
        """Whether it succeeded, with joint velocities within their limits and the tolerance."""
        return self.succeeded and self.rates_within

    @property
    def real_time_factor(self) -> float:
        """Simulated time over processor time: above 1 it is faster than real time."""
        return self.simulated_time / self.cpu_time if self.cpu_time > 0 else float("inf")

    @property
    def never_reached(self) -> tuple[MissedFoothold, ...]:
        """Those of :attr:`missed` whose steps were not done before the simulation ended."""
        return tuple(m for m in self.missed if m.reason is MissReason.NEVER_REACHED)

    @property
    def failures(self) -> tuple[str, ...]:
        """Why it did not pass, in words, the last with what may help; empty if :attr:`passed`."""
        found = []
        if not self.finished:
            found.append(f"the robot {self.status}")
        never = len(self.never_reached)
        if len(self.missed) > never:
            found.append(f"footholds missed: {len(self.missed) - never}")
        if never:
            found.append(f"footholds never reached: {never}")
        if not self.rates_within:
            found.append(
                f"a joint velocity reached {self.rate_use:.1%} of its limit, and the servos' "
                f"tolerance ends at {1.0 + self.servo_tolerance:.0%}"
            )
        if found:
            found[-1] = "; ".join([found[-1], *self._light(), *self.doubts])
        return tuple(found)

    def _light(self) -> list[str]:
        """What may be wrong where joints are too fast or feet leave their places."""
        left = any(m.reason is MissReason.LEFT for m in self.missed)
        return [LIGHT] if (left or not self.rates_within) and not self.known_motors else []

    @property
    def verdict(self) -> str:
        """``"passed"``, or ``"failed: "`` with the reasons."""
        return "passed" if self.passed else "failed: " + "; ".join(self.failures)

    def _missed_words(self) -> str:
        """The footholds that were missed, and how many were never reached, in words."""
        tried = [m for m in self.missed if m.reason is not MissReason.NEVER_REACHED]
        told = [f"{m.leg} in step {m.step + 1} {m.reason.words}" for m in tried[:5]]
        if len(tried) > 5:
            told.append(f"{len(tried) - 5} more")
        if self.never_reached:
            first = self.never_reached[0].step + 1
            told.append(f"{len(self.never_reached)} never reached, from step {first} on")
        return ", ".join(told) or "none"

    def _shapes(self) -> str:
        """What of the robot touched what, in words."""
        if not (self.own_shapes or self.settings.limbs):
            return "balls at the feet"
        more = f" and {len(self.bumps) - 4} more" if len(self.bumps) > 4 else ""
        beside = f"{', '.join(self.bumps[:4])}{more}" if self.bumps else "nothing"
        kind = "those of the robot's own MJCF" if self.own_shapes else "balls at the feet, limbs"
        return f"{kind}; {beside} touched beside the feet"

    def __repr__(self) -> str:
        passed = "passed" if self.passed else f"failed, {self.status}"
        return f"SimulationResult({passed}, {self.steps_done} of {self.steps} steps)"

    def _repr_html_(self) -> str:
        """The report for notebooks, with a coloured verdict."""
        colour = "#1b7f4b" if self.passed else "#b3261e"
        verdict, *lines = map(escape, str(self).splitlines())
        return f'<b style="color:{colour}">{verdict}</b><br>' + "<br>".join(lines)

    def __str__(self) -> str:
        """The report as plain text; its first line is the :attr:`verdict`."""
        return "\n".join([
            self.verdict,
            f"{self.status} at {self.end:.1f} s, {self.steps_done} of {self.steps} steps, "
            f"{self.waited:.2f} s of it waiting for feet",
            f"missed footholds: {self._missed_words()}",
            f"largest landing error {1e3 * self.landing_error:.1f} mm, "
            f"slip {1e3 * self.slip:.1f} mm",
            f"largest tilt {np.degrees(self.tilt):.2f} deg, "
            f"body error {1e3 * self.body_error:.1f} mm",
            f"smallest margin of the true COM {1e3 * self.smallest_margin:.1f} mm",
            f"peaks: torque {self.torque_use:.0%} of the limit, joint velocity "
            f"{self.rate_use:.0%} (tolerance {1.0 + self.servo_tolerance:.0%})",
            f"shapes: {self._shapes()}",
            f"work of the joints {self.energy:.0f} J; "
            f"{self.real_time_factor:.1f} times as fast as real time",
        ])  # fmt: skip
