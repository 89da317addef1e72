"""Small robot files as text: legs, heads, arms and wheels as people's files have them."""

from __future__ import annotations

import math
from collections.abc import Mapping

CORNERS = {"LF": (0.2, 0.1), "LH": (-0.2, 0.1), "RH": (-0.2, -0.1), "RF": (0.2, -0.1)}
UPPER, LOWER, OUT = 0.25, 0.22, 0.04
BODY_MASS, LINK_MASS = 5.0, 0.5
LIMIT = '<limit lower="-2.5" upper="2.5" effort="30" velocity="12"/>'
KNEE = '<limit lower="-2.6" upper="-0.3" effort="30" velocity="12"/>'


def inertial(mass: float, xyz: str = "0 0 0") -> str:
    """A link's `<inertial>`: that of a ball."""
    inertia = 0.01 * mass
    return (
        f'<inertial><origin xyz="{xyz}"/><mass value="{mass!r}"/><inertia ixx="{inertia!r}" '
        f'iyy="{inertia!r}" izz="{inertia!r}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def link(name: str, mass: float = LINK_MASS, inside: str = "") -> str:
    """A link; without a mass where it is 0."""
    return f'<link name="{name}">{inertial(mass) if mass else ""}{inside}</link>'


def joint(
    name: str, parent: str, child: str, xyz: str = "0 0 0", kind: str = "fixed", axis: str = "",
    limit: str = LIMIT, rpy: str = "0 0 0",
) -> str:  # fmt: skip
    """A joint."""
    turn = f'<axis xyz="{axis}"/>' if axis else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/>{turn}{limit if axis else ""}</joint>'
    )


def collision(shape: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    """A collision shape."""
    return f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'


FOOT = collision('<sphere radius="0.03"/>')


def leg(
    name: str,
    foot: str | None = FOOT,
    shank: str = "",
    kinds: tuple[str, str, str] = ("revolute",) * 3,  # type: ignore[assignment]
    limits: tuple[str, str, str] = (LIMIT, LIMIT, KNEE),
    axes: tuple[str, str, str] = ("1 0 0", "0 1 0", "0 1 0"),
    masses: tuple[float, float, float] = (LINK_MASS,) * 3,  # type: ignore[assignment]
    base: str = "base",
) -> str:
    """A roll-pitch-pitch leg; without a foot link where `foot` is `None`."""
    x, y = CORNERS[name]
    out = OUT if name.startswith("L") else -OUT
    parts, parent = [], base
    places = (f"{x} {y} 0", f"0 {out} 0", f"0 0 {-UPPER}")
    for k in range(3):
        child = f"{name}_l{k}"
        parts.append(link(child, masses[k], shank if k == 2 else ""))
        parts.append(joint(f"{name}_j{k}", parent, child, places[k], kinds[k], axes[k], limits[k]))
        parent = child
    if foot is not None:
        parts.append(link(f"{name}_foot", 0.1, foot))
        parts.append(joint(f"{name}_end", parent, f"{name}_foot", f"0 0 {-LOWER}"))
    return "".join(parts)


def robot(
    extra: str = "", before: str = "", changed: Mapping[str, str] | None = None, **legs: object
) -> str:
    """A robot of four legs.

    Args:
        extra: more links and joints.
        before: links and joints before the base.
        changed: texts of legs that differ from the others, by name.
        legs: arguments of :func:`leg` for all legs.
    """
    texts = {name: leg(name, **legs) for name in CORNERS}  # type: ignore[arg-type]
    texts.update(changed or {})
    return (
        f'<robot name="tester">{before}{link("base", BODY_MASS)}{"".join(texts.values())}{extra}'
        "</robot>"
    )


MASS = BODY_MASS + 4 * (3 * LINK_MASS + 0.1)
"""Mass of :func:`robot` as it comes."""

MJCF = """
<mujoco model="tester">
  <compiler angle="{angle}" autolimits="true"/>
  <default>
    <default class="leg">
      <joint armature="0.02" damping="0.5"/>
      <default class="knee"><joint range="{knee}"/></default>
    </default>
  </default>
  <asset>{assets}</asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" material="absent"/><light pos="0 0 3"/>
    <body name="trunk" pos="0 0 0.5" childclass="leg">
      <freejoint/>
      <inertial pos="0.01 0 0.02" mass="5" diaginertia="0.05 0.06 0.07"/>
      {legs}{extra}
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
  {tail}
</mujoco>
"""


def mjcf_leg(name: str, foot: str = '<geom size="0.03" pos="0 0 -0.22"/>') -> str:
    """A leg of an MJCF, whose hip joint lies beside its body's origin."""
    x, y = CORNERS[name]
    out = OUT if name.startswith("L") else -OUT
    return f"""
    <body name="{name}_hip" pos="{x} {y} 0.1">
      <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
      <joint name="{name}_j0" axis="1 0 0" pos="0 0 -0.1" range="-{{turn}} {{turn}}"/>
      <body name="{name}_thigh" pos="0 {out} -0.1" euler="0 {{tilt}} 0">
        <inertial pos="0 0 -0.1" quat="0.8 0.6 0 0" mass="0.6" diaginertia="0.004 0.003 0.002"/>
        <joint name="{name}_j1" axis="0 1 0"/>
        <body name="{name}_shank" pos="0 0 -{UPPER}">
          <joint name="{name}_j2" class="knee" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.22" size="0.01" mass="0.2"/>{foot}
        </body>
      </body>
    </body>"""


def mjcf(
    extra: str = "", tail: str = "", assets: str = "", degrees: bool = True,
    foot: str | None = None, actuators: str | None = None,
) -> str:  # fmt: skip
    """A robot of four legs as MJCF, by default with plain motors."""
    legs = "".join(mjcf_leg(name) if foot is None else mjcf_leg(name, foot) for name in CORNERS)
    turn, tilt, knee = ("60", "10", "-150 -20") if degrees else ("1.0", "0.2", "-2.6 -0.3")
    plain = "".join(
        f'<motor name="{n}_m{k}" joint="{n}_j{k}" gear="{2 if k else 1}" ctrlrange="-20 20"/>'
        for n in CORNERS for k in range(3)
    )  # fmt: skip
    return MJCF.format(
        angle="degree" if degrees else "radian", knee=knee, assets=assets, extra=extra, tail=tail,
        legs=legs.format(turn=turn, tilt=tilt), actuators=plain if actuators is None else actuators,
    )  # fmt: skip


MJCF_MASS = 5.0 + 4 * (0.5 + 0.6 + 0.2 + 1000.0 * 4.0 / 3.0 * math.pi * 0.03**3)
"""Mass of :func:`mjcf` as it comes: the balls of the feet have MuJoCo's density, that of water."""
