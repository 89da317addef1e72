"""A four-legged robot: its URDF, Pinocchio model, and the kinematics of its legs."""

from __future__ import annotations

import hashlib
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from gaitopt.arguments import checked
from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import InputError, RobotError
from gaitopt.files import silenced_stderr
from gaitopt.hidden_packages import refuse_shadows
from gaitopt.inputs import as_text
from gaitopt.robots import limits
from gaitopt.robots.at_many_poses.four_legs import FourLegs
from gaitopt.robots.files.notes import Notes, read_notes
from gaitopt.robots.leg import Leg
from gaitopt.robots.leg_names import LegMapping, by_leg
from gaitopt.robots.standing import foot_below_hip, standing_height
from gaitopt.robots.urdf_text import check_masses, check_urdf
from gaitopt.robots.xml_text import shown

CLOSED_FORM_TOLERANCE = 1e-9
"""Largest disagreement allowed between the legs' kinematics and Pinocchio when a robot is loaded
[m]: both are rounded to about 1e-15 m, and a leg that was read wrongly is off by millimetres."""
_KNEES = {"forward": 1.0, "backward": -1.0}


@dataclass(frozen=True, eq=False)
class Quadruped:
    """A four-legged robot, as planners and consumers of plans use it.

    Build one with :func:`gaitopt.load_robot`, or from URDF text with :meth:`from_urdf`.

    Attributes:
        name: the catalogue's name, or the name inside the URDF.
        urdf: the URDF's text.
        model: Pinocchio's model with a free-flying base. Its ``armature`` is the motors' inertia.
        legs: the four legs by name, in the order of :data:`gaitopt.LEGS`; ``legs["FL"]`` and
            ``legs["front_left"]`` are found, too.
        body_axes: axes of the body frame (x forward, y left, z up) as columns in the base
            frame ``(3, 3)``. Body and base share their origin.
        centre: middle of the four hips in the body frame ``(3,)`` [m]. It is the body centre, which
            [Wang2020] calls COG.
        knees: sides of the knees, as they were given to :meth:`from_urdf`.
        closed_form_error: largest distance between the legs' kinematics and Pinocchio's that was
            seen at load [m].
        notes: what was read and guessed of the file that the URDF was made of.
    """

    name: str
    urdf: str
    model: Any
    legs: Mapping[str, Leg]
    body_axes: FloatArray
    centre: FloatArray
    knees: Mapping[str, str] = field(default_factory=dict)
    closed_form_error: float = 0.0
    notes: Notes = field(default_factory=Notes)

    @classmethod
    @checked
    def from_urdf(
        cls, urdf: str, name: str | None = None, knees: Mapping[str, str] | None = None
    ) -> Quadruped:
        """Read a robot from URDF text.

        Args:
            urdf: the text. Meshes it names are not read.
            name: what to call the robot; the URDF's own name by default.
            knees: side per leg, ``"forward"`` or ``"backward"``, where the knee's limits leave
                both open; front knees backward and hind knees forward by default.

        Raises:
            RobotError: no valid URDF, not four legs of two or three hinges, a leg of two hinges
                that is not pitch-pitch, or one of three that cannot stand and move its foot in all
                directions.
            InputError: ``knees`` names an unknown leg or side.
            MissingPackageError: another module hides Pinocchio, CasADi or MuJoCo.
        """
        refuse_shadows()
        import pinocchio as pin

        from gaitopt.robots import discovery, leg_reading

        sides = _knee_sides(knees)
        label = shown(name or "URDF")
        check_urdf(urdf, label)
        try:
            with silenced_stderr() as said:
                model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
        except Exception as error:  # Pinocchio raises errors of several kinds
            # Without the places in Pinocchio's own source text.
            words = re.sub(r" at line \d+ in \S+", "", " ".join(f"{error} {said()}".split()))[:300]
            raise RobotError(f"{label}: Pinocchio cannot read this URDF: {words}") from error
        check_masses(model, urdf, label)
        if name:
            # Names of files may hold bytes that are no letters.
            model.name = name.encode("utf-8", "backslashreplace").decode()
        notes = read_notes(urdf, label)
        # Pinocchio adds it to the diagonal of the mass matrix in all of its algorithms.
        model.armature[6:] = limits.motor_inertia(model, notes.armature)
        chains = discovery.find_chains(model)
        known = discovery.with_feet(model, chains, notes.feet) if notes.feet else None
        chains = list(known.values()) if known else chains
        axes = discovery.heading_axes(model.name, chains, known)
        named = discovery.assign_names(model.name, chains, axes)
        discovery.refuse_other_corners(model.name, known or named, named)
        legs = {
            leg: leg_reading.read_leg(model, leg, chain, axes, sides.get(leg))
            for leg, chain in named.items()
        }
        robot = cls(
            name=shown(str(model.name)),
            urdf=urdf,
            model=model,
            legs=LegMapping(legs),
            body_axes=frozen(axes),
            centre=frozen(np.mean([leg.hip for leg in legs.values()], axis=0)),
            knees=MappingProxyType(dict(knees or {})),
            notes=notes,
        )
        return replace(robot, closed_form_error=_check_closed_form(robot))

    def __reduce__(self) -> tuple[Any, ...]:
        return (Quadruped.from_urdf, (self.urdf, self.name, dict(self.knees)))

    def __eq__(self, other: object) -> bool:
        """Whether URDF, name, given sides of the knees, hulls and Pinocchio's model are the same.

        All else follows from these. The model is among them because it can be changed in memory,
        and the hulls of meshes because they are known only where the mesh files were found.
        """
        if not isinstance(other, Quadruped):
            return NotImplemented
        if self is other:
            return True
        same = self.__reduce__()[1] == other.__reduce__()[1]
        return same and self.notes.hulls == other.notes.hulls and bool(self.model == other.model)

    def __hash__(self) -> int:
        return hash((self.sha256, self.name))

    def __repr__(self) -> str:
        return (
            f"Quadruped({self.name!r}, {self.mass:.4g} kg, "
            f"{len(self.joint_names)} joints, legs {' '.join(self.legs)})"
        )

    @cached_property
    def sha256(self) -> str:
        """Fingerprint of the URDF's text."""
        return hashlib.sha256(self.urdf.encode()).hexdigest()

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        import pinocchio as pin

        return float(pin.computeTotalMass(self.model))

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """All joints after the free-flyer, in Pinocchio's order (legs, and any others)."""
        return tuple(str(n) for n in self.model.names[2:])

    @cached_property
    def leg_columns(self) -> Mapping[str, tuple[int, ...]]:
        """For each leg the positions of its joints in :attr:`joint_names`."""
        order = {name: i for i, name in enumerate(self.joint_names)}
        return LegMapping({leg: tuple(order[j] for j in self.legs[leg].joints) for leg in LEGS})

    @cached_property
    def leg_joint_columns(self) -> np.ndarray:
        """Positions in :attr:`joint_names` of the joints of all legs ``(12,)``.

        Leg by leg in the order of :data:`gaitopt.LEGS`, each from body to foot; ``(8,)`` for legs
        without roll joint.
        """
        columns = np.concatenate([self.leg_columns[leg] for leg in LEGS])
        columns.setflags(write=False)
        return columns

    @cached_property
    def four_legs(self) -> FourLegs | None:
        """The legs as arrays, in the order of :data:`gaitopt.LEGS`; ``None`` where they differ."""
        return FourLegs.of([self.legs[leg] for leg in LEGS])

    def own_data(self) -> Any:
        """Pinocchio's data for :attr:`model`, one for each thread, made when it is first asked for.

        Making it takes as long as ten of Pinocchio's algorithms. What is in it means nothing: read
        what you have computed before you give the thread to anybody else.
        """
        data = getattr(self._data, "of_model", None)
        # A model that was given joints or frames in memory needs other data.
        if data is None or (len(data.oMi), len(data.oMf)) != (
            self.model.njoints,
            self.model.nframes,
        ):
            data = self._data.of_model = self.model.createData()
        return data

    @cached_property
    def _data(self) -> threading.local:
        return threading.local()

    @cached_property
    def position_limits(self) -> FloatArray:
        """Lower and upper joint limits in the order of :attr:`joint_names` ``(2, nj)`` [rad].

        ``-inf`` and ``inf`` for joints without.
        """
        return limits.position_limits(self.model)

    @cached_property
    def velocity_limits(self) -> FloatArray:
        """Joint velocity limits in the order of :attr:`joint_names` ``(nj,)`` [rad/s].

        ``inf`` for joints without.
        """
        return limits.velocity_limits(self.model)

    @cached_property
    def effort_limits(self) -> FloatArray:
        """Joint torque limits in the order of :attr:`joint_names` ``(nj,)`` [N m].

        ``inf`` for joints without.
        """
        return limits.effort_limits(self.model)

    @cached_property
    def acceleration_limits(self) -> FloatArray:
        """Joint acceleration limits in the order of :attr:`joint_names` ``(nj,)`` [rad/s^2].

        ``inf`` for joints without: no robot file tells them (:func:`gaitopt.load_robot`).
        """
        return limits.acceleration_limits(self.model, self.notes.accelerations)

    @cached_property
    def motor_inertia(self) -> FloatArray:
        """Inertia of motor and gear seen at each joint ``(nj,)`` [kg m^2]; 0 where none is known.

        In the order of :attr:`joint_names`.
        """
        return limits.motor_inertia(self.model, self.notes.armature)

    @cached_property
    def torque_lines(self) -> FloatArray:
        """Speeds up to which joints have their whole torque, and at which none ``(2, nj)`` [rad/s].

        In the order of :attr:`joint_names`; ``inf`` where the torque does not fall with the speed.
        """
        return limits.torque_lines(self.model, self.notes.torque_lines)

    @cached_property
    def foot_radius(self) -> float:
        """Radius of the ball at the foot frame [m]; 0 where the file tells none.

        Footholds and the plan's feet are places of the foot *frame*, the ball's centre; the ground
        lies this much lower.
        """
        from gaitopt.robots.feet import ball_radius

        if self.notes.foot_radius is not None:
            return self.notes.foot_radius
        return ball_radius(self.urdf, [leg.foot for leg in self.legs.values()])

    @property
    def stance_size(self) -> tuple[float, float]:
        """Length and width of the stance with every foot straight below its hip [m]."""
        feet = np.array([leg.hip[:2] + leg.axes[:2, 1] * leg.lateral for leg in self.legs.values()])
        spread = np.abs(feet - feet.mean(axis=0)).mean(axis=0) * 2.0
        return float(round(spread[0], 6)), float(round(spread[1], 6))

    @cached_property
    def standing_height(self) -> float:
        """Height of the hips above the feet of a standing robot, in whole centimetres [m].

        It is that of the file's standing pose, where it has one. Otherwise it is
        :data:`gaitopt.robots.standing.STANDING_SHARE` of the legs' reach, or more where the knees
        bend little: 0.40 m for wang2020. Where a joint would leave its limits, it is the nearest
        height at which none does.
        """
        return standing_height(list(self.legs.values()), self.notes.standing)

    def standing_joints(self) -> FloatArray:
        """Joint angles ``(nj,)`` [rad] with every foot below its hip, at the standing height."""
        joints = self.neutral_joints()
        for name, leg in self.legs.items():
            foot = foot_below_hip(leg, self.standing_height)
            joints[list(self.leg_columns[name])] = leg.inverse(foot)
        return joints

    def require_velocity_limits(self) -> None:
        """Refuse a robot with a leg's joint that has no velocity limit: nothing bounds its speed.

        Raises:
            InputError: names the joint.
        """
        for leg in self.legs.values():
            for joint, limit in zip(leg.joints, leg.velocity_limits, strict=True):
                if not np.isfinite(limit):
                    raise InputError(
                        f"{self.name}: joint {joint} has no velocity limit; set a positive one in "
                        'the URDF (<limit velocity="...">)'
                    )

    def require_masses(self) -> None:
        """Refuse a robot without mass: nothing can be said of its forces or its centre of mass.

        Raises:
            InputError: names the robot and the way out.
        """
        if not self.mass > 0.0:
            raise InputError(
                f"{self.name}: its URDF has no masses (<inertial>), so its centre of mass and "
                "contact forces are not known; add them, or plan with timing='velocity'"
            )

    def neutral_joints(self) -> FloatArray:
        """Joint angles ``(nj,)`` [rad] nearest to zero within the limits.

        Planners keep joints at them that belong to no leg.
        """
        return np.asarray(np.clip(0.0, *self.position_limits))


def _knee_sides(knees: Mapping[str, str] | None) -> dict[str, float]:
    """The sides of knees as numbers, by leg; raises InputError for an unknown leg or side."""
    sides = by_leg("knees", {} if knees is None else knees)
    for leg, side in sides.items():
        if side not in list(_KNEES):
            raise InputError(f"knees: {leg}: must be 'forward' or 'backward', got {as_text(side)}")
    return {leg: _KNEES[side] for leg, side in sides.items()}


def _check_closed_form(robot: Quadruped, configurations: int = 8) -> float:
    """Largest distance between the legs' kinematics and Pinocchio over random joint angles [m]."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    rng = np.random.default_rng(0)
    q = pin.neutral(model)
    worst = {leg: 0.0 for leg in LEGS}
    for _ in range(configurations):
        joints = rng.uniform(-np.pi, np.pi, len(robot.joint_names))
        q[7:] = joints
        pin.framesForwardKinematics(model, data, q)
        for name, leg in robot.legs.items():
            place = data.oMf[model.getFrameId(leg.foot)].translation
            ours = robot.body_axes @ leg.forward(joints[list(robot.leg_columns[name])])
            worst[name] = float(np.maximum(worst[name], np.linalg.norm(ours - place)))
    name = max(worst, key=lambda leg: np.nan_to_num(worst[leg], nan=np.inf))
    if not worst[name] <= CLOSED_FORM_TOLERANCE:
        raise RobotError(
            f"{robot.name}: the kinematics of leg {name} disagree with Pinocchio by "
            f"{worst[name]:.3g} m; please report this, with the file"
        )
    return worst[name]
