"""Options that several commands share."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class Objective(str, Enum):
    """Where the body goes before each swing."""

    distance = "distance"
    margin = "margin"
    time = "time"


class Com(str, Enum):
    """What keeps the stability margin: the body's centre, or the whole model's centre of mass."""

    body = "body"
    model = "model"


FootholdsOption = Annotated[
    Path | None,
    typer.Option(help="CSV file with the columns leg,step,x,y,z, in metres.", metavar="CSV",
                 rich_help_panel="What walks where"),
]  # fmt: skip
SeedOption = Annotated[
    int | None,
    typer.Option(help="Seed of the random S-shaped columns, when no CSV is given.", min=0,
                 rich_help_panel="What walks where"),
]  # fmt: skip
SeedsOption = Annotated[
    int,
    typer.Option(help="Go over this many random terrains, from --seed on.", min=1, max=10_000,
                 rich_help_panel="What walks where"),
]  # fmt: skip
ObjectiveOption = Annotated[
    Objective,
    typer.Option(help="Move the body as little as possible (distance), or to the largest stability "
                 "margin (margin), or optimise all steps together for the least time (time).",
                 rich_help_panel="How"),
]  # fmt: skip
SpeedOption = Annotated[
    str,
    typer.Option(help="'max', or a speed of body and feet in m/s (within the joint limits).",
                 rich_help_panel="How"),
]  # fmt: skip
MarginOption = Annotated[
    float | None,
    typer.Option(help="Stability margin, in metres: how far inside the polygon of the standing "
                 "feet the robot's centre stays. Default: 0.07 of the standing height, 0.028 for "
                 "wang2020; with --timing velocity 0.05 of it, 0.02 for wang2020.",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
HeightOption = Annotated[
    float | None,
    typer.Option(help="Height of the hips above the footholds, in metres; 0.40 for wang2020, "
                 "0.7 of the leg's reach for others.", rich_help_panel="How", show_default=False),
]  # fmt: skip
SwingHeightOption = Annotated[
    float | None,
    typer.Option(help="How far feet rise above the higher end of a swing, in metres; 0.07 for "
                 "wang2020, in proportion to the robot's size for others.",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
SequenceOption = Annotated[
    str,
    typer.Option(help="Order of the legs in a cycle, as in RH,RF,LH,LF (or RR,FR,RL,FL), or 'free' "
                 "to search for the fastest order.",
                 rich_help_panel="How"),
]  # fmt: skip
ReachOption = Annotated[
    float,
    typer.Option(help="Share of the legs' reach that is used, up to 1.", rich_help_panel="How"),
]
HeadingOption = Annotated[
    float, typer.Option(help="Direction the body faces, in radians from x.", rich_help_panel="How")
]
FollowOption = Annotated[
    bool,
    typer.Option("--follow-terrain", help="Keep the body at its height above the feet, and not "
                 "above the mean of all footholds.",
                 rich_help_panel="How"),
]  # fmt: skip
FreeOption = Annotated[
    str | None,
    typer.Option(help="With the objective time, what is optimised: route, overlap, swing "
                 "(default), height, posture or dynamic.",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
ComOption = Annotated[
    Com | None,
    typer.Option(help="What keeps the margin: the body's centre, or the true centre of mass of the "
                 "whole model (by default with the timing forces).", rich_help_panel="How",
                 show_default=False),
]  # fmt: skip
AccelerationOption = Annotated[
    float | None,
    typer.Option(help="With the objective time, a limit of every joint's acceleration, in rad/s².",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
HorizonOption = Annotated[
    int | None,
    typer.Option(help="With the objective time, plan only so many steps ahead at a time.",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
CollisionsOption = Annotated[
    bool,
    typer.Option(help="Check for self-collisions."),
]
ForcesOption = Annotated[
    bool,
    typer.Option(help="Look for contact forces and joint torques that make the motion, also where "
                 "the plan promises none."),
]  # fmt: skip


class Timing(str, Enum):
    """What bounds a walk's speed."""

    forces = "forces"
    velocity = "velocity"


TimingOption = Annotated[
    Timing,
    typer.Option(help="What bounds the speed: contact forces, joint torques and velocities; or "
                 "joint velocities alone, as in the paper (nothing is promised of forces).",
                 rich_help_panel="How"),
]  # fmt: skip
FRICTIONS = (0.001, 10.0)
"""Least and largest friction: those of :class:`gaitopt.ForceLimits`, whose module would make the
command line slow to start."""
FrictionOption = Annotated[
    float | None,
    typer.Option(help="Friction between feet and ground, for contact forces (0.6 by default).",
                 min=FRICTIONS[0], max=FRICTIONS[1], show_default=False),
]  # fmt: skip
LONGEST_TRANSFER = 10.0
"""Longest transfer time of :class:`gaitopt.ForceLimits` [s], stated here for the same reason."""
TransferOption = Annotated[
    float | None,
    typer.Option("--transfer-time", min=0.0, max=LONGEST_TRANSFER, metavar="SECONDS",
                 show_default=False, rich_help_panel="How",
                 help="Time within which a foot takes over the weight after it has landed, and "
                      "gives it up before it lifts off; 0, the default, lets forces jump."),
]  # fmt: skip
JobsOption = Annotated[
    int, typer.Option(help="Number of processes for many terrains; -1 for one on each core.")
]
JsonOption = Annotated[
    bool,
    typer.Option("--json", help="Print one JSON document, for programs, in place of text.",
                 rich_help_panel="What is written"),
]  # fmt: skip
PlanArgument = Annotated[
    Path, typer.Argument(help="A plan file (.npz), or the folder of its run.", metavar="PLAN")
]
