"""Studies as tables for the terminal and for documents."""

from __future__ import annotations

import io

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gaitopt.conventions import FloatArray
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies.compare import PAPER_DISTANCE, PAPER_GAINS, Comparison, Method


def comparison_table(comparison: Comparison) -> Table:
    """Table II, the paper's figures in brackets; mean and spread over several terrains."""
    count = len(comparison.seeds)
    spread = f", mean ± standard deviation over {count} terrains" if count > 1 else ""
    table = Table(
        title=f"{comparison.robot}: Table II over the same footholds"
        f"{' (paper)' if _is_papers(comparison) else ''}{spread}",
        caption=_caption(comparison),
        caption_justify="left",
        padding=(0, 1 if count == 1 else 0),
    )
    table.add_column("method", no_wrap=True)
    for header in ("time [s]", "speed [mm/s]", "COG path [m]", "swing %", "stance %",
                   "margin [mm]", "true COM [mm]", "speed-up [%]"):  # fmt: skip
        table.add_column(escape(header), justify="right")
    for method in comparison.methods:
        table.add_row(*_row(comparison, method))
    return table


def as_text(table: Table, width: int = 140) -> str:
    """A table as plain text."""
    console = Console(file=io.StringIO(), width=width, color_system=None, legacy_windows=False)
    console.print(table)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def _is_papers(comparison: Comparison) -> bool:
    """Whether the paper's figures belong beside ours: it has one robot only."""
    return comparison.robot == "wang2020"


def _row(comparison: Comparison, method: Method) -> list[str]:
    name = method.name
    paper = method.paper_time if _is_papers(comparison) else None

    def number(quantity: str, digits: int, scale: float = 1.0) -> str:
        return _spread(comparison.values(name, quantity) * scale, digits)

    swing = 100 * float(comparison.values(name, "swing_share").mean())
    least = [1e3 * float(comparison.values(name, q).min()) for q in ("margin", "com_margin")]
    return [
        name,
        number("time", 1) + ("" if paper is None else f" ({paper:.0f})"),
        number("mean_speed", 2, 1e3)
        + ("" if paper is None else f" ({1e3 * PAPER_DISTANCE / paper:.2f})"),
        number("cog_distance", 2),
        f"{swing:.0f}",
        f"{100 - swing:.0f}",
        f"{least[0]:.1f}",
        f"{least[1]:.1f}",
        "" if method is comparison.methods[0] else _gain(comparison, method),
    ]


def _gain(comparison: Comparison, method: Method) -> str:
    own = f"+{_spread(100.0 * comparison.speed_up(method.name), 0)}"
    first = comparison.methods[0].paper_time
    if method.paper_time is None or first is None or not _is_papers(comparison):
        return own
    told = PAPER_GAINS.get(method.name)
    return own if told is None else f"{own} ({told:.1f})"


def _spread(values: FloatArray, digits: int) -> str:
    mean = f"{values.mean():.{digits}f}"
    return mean if len(values) < 2 else f"{mean} ± {values.std(ddof=1):.{digits}f}"


def _caption(comparison: Comparison) -> str:
    lines = [
        "margin: smallest over all swings, of the body centre (planned with) and of the model's "
        "true COM.",
        f"speed-up: of {comparison.methods[0].name!r} over this method.",
    ]
    if _is_papers(comparison):
        lines.append(
            "In brackets: the paper, whose terrain, hip height and margin are not published."
        )
    if comparison.refused:
        seeds = ", ".join(str(seed) for seed, _ in comparison.refused[:10])
        lines.append(
            f"{len(comparison.refused)} terrains left out as infeasible (seeds {seeds}): "
            f"{comparison.refused[0][1]}"
        )
    return "\n".join(lines)


def robot_table(robot: Quadruped) -> Table:
    """What was read off a robot's URDF, a row a joint."""
    table = Table(
        title=f"{robot.name}: {robot.mass:.4g} kg, stance {robot.stance_size[0]:.3f} x "
        f"{robot.stance_size[1]:.3f} m, foot radius {1e3 * robot.foot_radius:.4g} mm",
        caption=f"closed-form kinematics and Pinocchio agree to {robot.closed_form_error:.1e} m",
    )
    for header in ("leg", "joint", "limits [rad]", "velocity [rad/s]", "hip [m]", "links [m]",
                   "offset [m]", "knee", "reach [m]"):  # fmt: skip
        table.add_column(escape(header))
    for name, leg in robot.legs.items():
        hip = " ".join(f"{x:.3f}" for x in leg.hip)
        for i, joint in enumerate(leg.joints):
            low, high = leg.position_limits[:, i]
            row = [name, joint, f"{low:.3g} .. {high:.3g}", f"{leg.velocity_limits[i]:.4g}"]
            if i == 0:
                row += [hip, f"{leg.upper:.3f} {leg.lower:.3f}", f"{leg.lateral:.3f}",
                        "forward" if leg.knee > 0 else "backward",
                        f"{leg.least_reach:.3f} .. {leg.reach:.3f}"]  # fmt: skip
            table.add_row(*row, end_section=i == len(leg.joints) - 1)
    return table
