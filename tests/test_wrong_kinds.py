"""What is no object of the right class is refused by a typed error, whatever function it is."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from typing import Any

import pytest

import gaitopt
from gaitopt.errors import GaitoptError


def takers() -> list[str]:
    """Public functions and classes that need an argument; enumerations have Python's own error."""
    found = []
    for name in gaitopt.__all__:
        value: Any = getattr(gaitopt, name)
        if not callable(value) or inspect.isabstract(value):
            continue
        if inspect.isclass(value) and issubclass(value, (BaseException, Enum)):
            continue
        if _needed(value):
            found.append(name)
    return found


def _needed(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """The parameters that must be given."""
    parameters = inspect.signature(function).parameters.values()
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [p for p in parameters if p.default is p.empty and p.kind not in kinds]


@pytest.mark.parametrize("value", ["walk", None])
@pytest.mark.parametrize("name", takers())
def test_a_text_or_nothing_in_place_of_every_argument(name: str, value: object) -> None:
    """Values that hold what they are given, and check nothing, are no error."""
    function: Any = getattr(gaitopt, name)
    alone = [p.name for p in _needed(function) if p.kind is not inspect.Parameter.KEYWORD_ONLY]
    named = [p.name for p in _needed(function) if p.kind is inspect.Parameter.KEYWORD_ONLY]
    try:
        function(*[value for _ in alone], **dict.fromkeys(named, value))
    except GaitoptError as error:
        assert str(error)
