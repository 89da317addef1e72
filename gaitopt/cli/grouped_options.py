"""Options that belong together: a function has them, and commands take what it makes of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints

from gaitopt.errors import InputError


def takes_options(
    name: str, group: Callable[..., Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of a function, and what the function returns for them.

    Args:
        name: of the command's parameter that gets the value; the options stand in its place.
        group: a function whose parameters are options, all with defaults.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own, options = _parameters(command), _parameters(group)
        named = {option.name for option in options}

        @wraps(command)
        def run(**given: Any) -> None:
            asked = {key: given.pop(key) for key in named & set(given)}
            command(**given, **{name: group(**asked)})

        kept = [p for p in own if p.name != name]
        shown = kept + options
        run.__annotations__ = {p.name: p.annotation for p in shown}
        vars(run)["__signature__"] = Signature(shown)
        return run

    return decorate


def numbers(option: str, text: str, *counts: int) -> tuple[float, ...]:
    """Numbers that are joined by commas.

    Args:
        option: its name, for errors.
        text: what was given.
        counts: how many there may be.

    Raises:
        InputError: it is something else.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in counts:
        many = " or ".join(str(count) for count in counts)
        raise InputError(f"{option} takes {many} numbers joined by commas, got {text!r}")
    return values


def _parameters(function: Callable[..., Any]) -> list[Parameter]:
    """The parameters of a function, with their types instead of the types' texts."""
    hints = get_type_hints(function, include_extras=True)
    return [p.replace(annotation=hints[p.name]) for p in signature(function).parameters.values()]
