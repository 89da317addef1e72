"""Sound robot files of several kinds, with their meshes, into which faults are put."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from gaitopt.robots.catalog import example_urdf, own_urdf

FILES_OF_USERS: Final = "GAITOPT_FUZZ_FILES"
"""Name of the variable of the environment with the files of ``--robot-file``."""
EXAMPLES: Final = ("go2", "hyq", "solo12")
"""Robots of example-robot-data whose URDF gets faults."""
CORNERS: Final = {"lf": (0.2, 0.1), "lh": (-0.2, 0.1), "rh": (-0.2, -0.1), "rf": (0.2, -0.1)}
LIMIT: Final = '<limit lower="-2.5" upper="2.5" effort="30" velocity="12"/>'
KNEE: Final = '<limit lower="-2.6" upper="-0.3" effort="30" velocity="12"/>'
BAR_CORNERS: Final = tuple(
    (x, y, z) for z in (0.0, -0.22) for y in (-0.015, 0.015) for x in (-0.015, 0.015)
)
BAR_FACES: Final = ((0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
                    (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5))  # fmt: skip
"""A bar as long as a lower leg, by its corners and the numbers of them at each triangle."""


class Source(NamedTuple):
    """A robot as files: the one that is loaded, by name, and all of them.

    Attributes:
        main: name of the file that is loaded.
        files: their contents by name.
        folders: where meshes of it lie that get no faults.
    """

    main: str
    files: Mapping[str, bytes]
    folders: tuple[Path, ...] = ()


@cache
def sources() -> tuple[Source, ...]:
    """All robots that get faults."""
    given = [Path(p) for p in os.environ.get(FILES_OF_USERS, "").split(os.pathsep) if p]
    paths = [own_urdf("wang2020"), own_urdf("frog1"), *map(example_urdf, EXAMPLES), *given]
    found = [Source(path.name, {path.name: path.read_bytes()}, tuple(path.resolve().parents)[:4])
             for path in paths]  # fmt: skip
    meshes = {"bar.stl": _stl(), "words.stl": _stl_words(), "bar.obj": _obj(), "bar.dae": _dae()}
    for name, mesh in meshes.items():
        files = {"dog.urdf": _urdf(name), name: mesh}
        found.append(Source("dog.urdf", files))
    found.append(Source("dog.xacro", {"dog.xacro": _xacro(), "leg.xacro": _xacro_leg()}))
    found.append(Source("dog.xml", {"dog.xml": _mjcf(), "bar.stl": _stl()}))
    return tuple(found)


def _link(name: str, mass: float, shapes: str = "") -> str:
    inertia = f'ixx="{0.01 * mass!r}" iyy="{0.01 * mass!r}" izz="{0.01 * mass!r}"'
    return (
        f'<link name="{name}">\n<inertial>\n<origin xyz="0 0 0"/>\n<mass value="{mass!r}"/>\n'
        f'<inertia {inertia} ixy="0" ixz="0" iyz="0"/>\n</inertial>\n{shapes}</link>\n'
    )


def _joint(name: str, parent: str, child: str, xyz: str, axis: str, limit: str) -> str:
    return (
        f'<joint name="{name}" type="revolute">\n<parent link="{parent}"/>\n'
        f'<child link="{child}"/>\n<origin xyz="{xyz}" rpy="0 0 0"/>\n<axis xyz="{axis}"/>\n'
        f"{limit}\n</joint>\n"
    )


def _leg(name: str, x: str, y: str, out: str, shank: str) -> str:
    """A leg without a foot link: its end is that of the lower leg's shape."""
    return (
        _link(f"{name}_hip", 0.5)
        + _joint(f"{name}_hip_joint", "base", f"{name}_hip", f"{x} {y} 0", "1 0 0", LIMIT)
        + _link(f"{name}_thigh", 0.6)
        + _joint(f"{name}_thigh_joint", f"{name}_hip", f"{name}_thigh", f"0 {out} 0", "0 1 0",
                 LIMIT)
        + _link(f"{name}_shank", 0.2, shank)
        + _joint(f"{name}_knee", f"{name}_thigh", f"{name}_shank", "0 0 -0.25", "0 1 0", KNEE)
    )  # fmt: skip


def _mesh(name: str) -> str:
    """Collision and picture of a mesh."""
    shape = f'<geometry>\n<mesh filename="{name}" scale="1 1 1"/>\n</geometry>\n'
    return f"<visual>\n{shape}</visual>\n<collision>\n{shape}</collision>\n"


def _urdf(mesh: str) -> bytes:
    legs = "".join(
        _leg(name, f"{x}", f"{y}", f"{0.04 if y > 0 else -0.04}", _mesh(mesh))
        for name, (x, y) in CORNERS.items()
    )
    return f'<robot name="dog">\n{_link("base", 5.0)}{legs}</robot>\n'.encode()


def _xacro() -> bytes:
    calls = "\n".join(f'<xacro:leg name="{name}" x="{x}" y="{y}"/>'
                      for name, (x, y) in CORNERS.items())  # fmt: skip
    return (
        '<?xml version="1.0"?>\n<robot name="dog" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        '<xacro:arg name="load" default="0.5"/>\n<xacro:property name="out" value="${0.02 * 2}"/>\n'
        '<xacro:include filename="leg.xacro"/>\n'
        f"{_link('base', 5.0).replace('5.0', '${4.5 + $(arg load)}', 1)}"
        f'<xacro:if value="${{$(arg load) &gt; 0}}">\n{calls}\n</xacro:if>\n</robot>\n'
    ).encode()


def _xacro_leg() -> bytes:
    ball = (
        '<collision>\n<origin xyz="0 0 -0.22"/>\n<geometry>\n<sphere radius="${out / 2}"/>\n'
        "</geometry>\n</collision>\n"
    )
    leg = _leg("${name}", "${x}", "${y}", "${out if y > 0 else -out}", ball)
    return (
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        f'<xacro:macro name="leg" params="name x:=0 y:=^|0.1">\n{leg}</xacro:macro>\n</robot>\n'
    ).encode()


def _mjcf() -> bytes:
    legs = "".join(
        f"""<body name="{name}_hip" pos="{x} {y} 0.1">
<inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
<joint name="{name}_j0" axis="1 0 0" pos="0 0 -0.1" range="-60 60"/>
<body name="{name}_thigh" pos="0 {0.4 * y} -0.1" euler="0 10 0">
<inertial pos="0 0 -0.1" quat="0.8 0.6 0 0" mass="0.6" diaginertia="0.004 0.003 0.002"/>
<joint name="{name}_j1" axis="0 1 0"/>
<body name="{name}_shank" pos="0 0 -0.25">
<joint name="{name}_j2" class="knee" axis="0 1 0"/>
<geom type="mesh" mesh="bar" mass="0.2"/>
<geom size="0.03" pos="0 0 -0.22"/>
</body>
</body>
</body>
"""
        for name, (x, y) in CORNERS.items()
    )
    motors = "".join(
        f'<general name="{name}_m{k}" joint="{name}_j{k}" gear="9" ctrlrange="-24 24" '
        'gainprm="0.5" biastype="affine" biasprm="0 0 -0.08" forcerange="-8 8"/>\n'
        for name in CORNERS for k in range(3)
    )  # fmt: skip
    joints = " ".join(["0 0.9 -1.5"] * 4)
    return f"""<mujoco model="dog">
<compiler angle="degree" autolimits="true"/>
<default>
<default class="leg">
<joint armature="0.02" damping="0.5" frictionloss="0.1"/>
<default class="knee">
<joint range="-150 -20"/>
</default>
</default>
</default>
<asset>
<mesh name="bar" file="bar.stl"/>
</asset>
<worldbody>
<geom name="floor" type="plane" size="1 1 1"/>
<body name="trunk" pos="0 0 0.5" childclass="leg">
<freejoint/>
<inertial pos="0.01 0 0.02" mass="5" diaginertia="0.05 0.06 0.07"/>
{legs}</body>
</worldbody>
<actuator>
{motors}</actuator>
<keyframe>
<key name="home" qpos="0 0 0.4 1 0 0 0 {joints}"/>
</keyframe>
</mujoco>
""".encode()


def _bar() -> object:
    import trimesh

    return trimesh.Trimesh(BAR_CORNERS, BAR_FACES)


def _stl() -> bytes:
    return _bar().export(file_type="stl")  # type: ignore[attr-defined, no-any-return]


def _stl_words() -> bytes:
    return _bar().export(file_type="stl_ascii").encode()  # type: ignore[attr-defined, no-any-return]


def _obj() -> bytes:
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in BAR_CORNERS)
    faces = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BAR_FACES)
    return f"# a bar\no bar\n{corners}{faces}".encode()


def _dae() -> bytes:
    places = " ".join(f"{value}" for corner in BAR_CORNERS for value in corner)
    numbers = " ".join(f"{value}" for face in BAR_FACES for value in face)
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="bar" name="bar"><mesh>
<source id="places"><float_array id="numbers" count="24">{places}</float_array>
<technique_common><accessor source="#numbers" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#corners" offset="0"/>
<p>{numbers}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="node">
<instance_geometry url="#bar"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
""".encode()
