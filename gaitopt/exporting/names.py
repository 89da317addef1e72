"""Names of robots, joints and links in files for other programs.

They come from files of others. A line feed would begin a new key in YAML, U+2028 and U+0085 end a
line for some readers, a comma begins a new cell of a table, ``=`` a formula of a spreadsheet, and
an escape character a command to the terminal. Names of joints and links are identifiers: those with
such characters are refused. A robot's name is for readers, and its special characters are escaped.
"""

from __future__ import annotations

from collections.abc import Iterable

from gaitopt.errors import InputError
from gaitopt.robots.xml_text import unsafe

LONGEST = 200
"""Most characters of a name: more is no name, and makes lines that nobody reads."""
FORBIDDEN = frozenset(",;\"'`\\<>&|")
"""They separate or quote in tables, XML, YAML and shells; names of ROS have none of them."""
FORMULA = frozenset("=+-@")
"""At the beginning of a cell they make spreadsheets compute it."""
YAML_SIGNS = frozenset("!%*?:[]{}#~")
"""At the beginning of a plain scalar they mean something else in YAML."""


def check_names(names: Iterable[str], what: str = "joint") -> tuple[str, ...]:
    """The names, if every consumer takes them as they are, and no two are the same.

    Args:
        names: of joints, links or topics.
        what: what has these names, for the message.

    Raises:
        InputError: a name is empty or too long, holds a character that cannot be printed, a
            separator or a quote, begins with a sign of formulas or of YAML, has a blank at an end,
            or stands twice.
    """
    checked = tuple(names)
    for name in checked:
        fault = _fault(name)
        if fault:
            raise InputError(
                f"the {what} {ascii(name)[:80]} {fault}: no file can hold it safely; give another "
                "name, in the robot's file or by joints={'old': 'new', ...}"
            )
    for name in checked:
        if checked.count(name) > 1:
            raise InputError(f"two of the {what}s are called {name!r}; give them different names")
    return checked


def _fault(name: object) -> str:
    """What is wrong with a name, in words; empty where nothing is."""
    if not isinstance(name, str):
        return "is no text"
    if not name or len(name) > LONGEST:
        return f"has {len(name)} characters, of 1 to {LONGEST}"
    for character in name:
        if unsafe(character) or character in FORBIDDEN:
            return f"holds the character U+{ord(character):04X}"
    if name[0] in FORMULA | YAML_SIGNS:
        return f"begins with {name[0]}"
    if name != name.strip():
        return "has a blank at an end"
    return ""
