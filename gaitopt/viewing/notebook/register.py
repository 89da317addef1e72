"""Tells IPython what to show of gaitopt's objects in notebooks."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, Final

CARDS: Final = {
    ("gaitopt.plan.plan", "Plan"): "plan_card",
    ("gaitopt.terrain.footholds", "Footholds"): "footholds_card",
    ("gaitopt.terrain.height_map", "HeightMap"): "ground_card",
    ("gaitopt.robots.quadruped", "Quadruped"): "robot_card",
}
"""Functions of :mod:`gaitopt.viewing.notebook.cards` by the classes that they show. They are named,
so that nothing is imported before it is shown."""


def register(shell: Any) -> None:
    """Let a running IPython show objects of gaitopt as cards.

    Args:
        shell: from ``IPython.get_ipython()``.
    """
    html = shell.display_formatter.formatters["text/html"]
    for (module, name), card in CARDS.items():
        html.for_type_by_name(module, name, _shown_by(card))


def _shown_by(card: str) -> Callable[[Any], str]:
    def show(value: Any) -> str:
        text: str = getattr(import_module("gaitopt.viewing.notebook.cards"), card)(value)
        return text

    return show
