"""The table that ``gaitopt robot`` prints."""

from __future__ import annotations

from rich.markup import escape
from rich.table import Table

from gaitopt.robots.quadruped import Quadruped


def robot_table(robot: Quadruped) -> Table:
    """A table of what was found in a robot's URDF, with a row for each joint."""
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
