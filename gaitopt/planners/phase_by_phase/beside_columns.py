"""What goes into columns in a walk that is planned over them, told to the user."""

from __future__ import annotations

from gaitopt.errors import FootholdsWarning, warn
from gaitopt.plan.columns import stands_on_columns
from gaitopt.plan.feet_in_columns import foot_in_column
from gaitopt.plan.limbs_in_columns import limb_in_column
from gaitopt.plan.plan import Plan
from gaitopt.plan.rolled_feet import foot_rolling_off


def warn_beside_columns(plan: Plan) -> None:
    """Tell what the certificate will find beside columns, and feet that roll nearly off them.

    Args:
        plan: any; without columns nothing is told.

    Warns:
        FootholdsWarning: a limb or a foot goes into a column, or the ball of a foot rolls nearly as
            far as its column is wide.
    """
    if not stands_on_columns(plan):
        return
    for look in (foot_in_column, limb_in_column, foot_rolling_off):
        found = look(plan)
        if found is not None:
            warn(found.in_words(), FootholdsWarning)
