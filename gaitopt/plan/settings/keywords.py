"""Planners take settings as one object or as keyword arguments, and show the latter to readers.

A planner is written with ``**options``; :func:`takes_settings` gives it the signature that
``help()``, Jupyter and documentation show: one keyword a field of its settings.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from gaitopt.errors import InputError
from gaitopt.inputs import as_text
from gaitopt.plan.settings.base import VELOCITY, PlanSettings, check_names
from gaitopt.robots.quadruped import Quadruped

Kind = TypeVar("Kind", bound=PlanSettings)
Planner = TypeVar("Planner", bound=Callable[..., Any])

LENGTHS = ("stability_margin", "body_height", "swing_height", "clearance")
"""Settings that fit the robot's size where they are left open."""


def chosen_settings(
    kind: type[Kind], robot: Quadruped, settings: PlanSettings | None, options: Mapping[str, Any]
) -> Kind:
    """The settings of a plan.

    Args:
        kind: the class of settings that the planner takes.
        robot: whose size the fields fit that are left open, where ``settings`` is ``None``.
        settings: all fields at once.
        options: fields by name; they replace those of ``settings``.

    Raises:
        InputError: ``settings`` is of another class, or an option is unknown or out of range.
    """
    if settings is None:
        return kind.for_robot(robot, **options).within(robot)
    if not isinstance(settings, kind):
        raise InputError(
            f"settings must be {kind.__name__}, got {as_text(settings)}; single settings are "
            "given by name, as in stability_margin=0.03"
        )
    check_names(kind, options)
    if options.get("timing") == VELOCITY:
        options = {"forces": None, **options}
    return replace(settings, **options).within(robot)


def takes_settings(*kinds: type[PlanSettings], **others: Any) -> Callable[[Planner], Planner]:
    """Show the fields of settings as keyword arguments of a planner with ``**options``.

    Args:
        kinds: settings whose fields are the keywords.
        others: keywords beside them, with their types.
    """

    def shown(planner: Planner) -> Planner:
        signature = inspect.signature(planner)
        kept = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        names = {f.name: (f.type, f.default) for kind in kinds for f in fields(kind)}
        names |= {name: (kind, None) for name, kind in others.items()}
        keywords = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, annotation=kind,
                default=OPEN if name in LENGTHS else default,
            )
            for name, (kind, default) in names.items()
            if name not in signature.parameters
        ]  # fmt: skip
        planner.__signature__ = signature.replace(parameters=[*kept, *keywords])  # type: ignore[attr-defined]
        return planner

    return shown


class _Open:
    """The default that a signature shows for a setting that is left open."""

    def __repr__(self) -> str:
        return "<fits the robot>"


OPEN = _Open()
