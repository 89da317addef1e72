"""XML of robot files, read so that a file from somebody else can do no harm."""

from __future__ import annotations

import re
import unicodedata
from typing import Any
from xml.etree import ElementTree

from gaitopt.errors import RobotError

LIMIT = 20_000_000
"""Most characters of a robot file that are read. The largest of example-robot-data has 70 000."""
MOST_NESTED = 200
"""Most elements inside one another. Chosen: a robot has up to 30, and deeper ones break readers
that call themselves for each."""
MOST_SHOWN = 1000
"""Most characters of a name that are shown."""
_PIECE = 65_536


def unsafe(character: str) -> bool:
    """Whether a character is a control, a format sign, a line end, or none at all.

    Files of others put them into names: terminals obey some, and some end lines.
    """
    return unicodedata.category(character)[0] in "CZ" and character != " "


def shown(text: str) -> str:
    """A text in one line for readers and terminals; what cannot be printed is escaped."""
    return "".join(
        c.encode("unicode_escape").decode() if unsafe(c) else c for c in text[:MOST_SHOWN]
    )


def parsed_xml(text: str, label: str, kind: str) -> ElementTree.Element:
    """The outermost element of a robot file.

    Args:
        text: of the file.
        label: what to call it in messages.
        kind: of the file, as ``URDF``.

    Raises:
        RobotError: it is no well-formed XML, too large or nested too deeply, or it declares
            entities.
    """
    refuse_entities(text, label, kind)
    if len(text) > LIMIT:
        raise RobotError(f"{label}: the {kind} is larger than {LIMIT / 1e6:.0f} MB")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise RobotError(f"{label}: the {kind} is no well-formed XML: {error}") from error
    level = [root]
    for _ in range(MOST_NESTED):
        level = [child for element in level for child in element]
    if level:
        raise nested_too_deeply(label, kind)
    return root


def without_namespace(text: str, label: str) -> str:
    """The text of a robot file without the namespace of its outermost element.

    Files of some programs name the schema of their elements so; what robots are made of has the
    same names in all of them.

    Args:
        text: of the file.
        label: what to call it in messages.

    Raises:
        RobotError: as for :func:`parsed_xml`.
    """
    root = parsed_xml(text, label, "file")
    space = root.tag[: root.tag.rfind("}") + 1]
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.removeprefix(space)
    return ElementTree.tostring(root, encoding="unicode")


def refuse_entities(text: str, label: str, kind: str) -> None:
    """Refuse document types and entities: a robot needs none, and attacks by XML use them.

    Raises:
        RobotError: the text declares one.
    """
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, flags=re.IGNORECASE):
        raise RobotError(
            f"{label}: the {kind} declares a document type or entities, which are not read; "
            "remove the <!DOCTYPE ...> part"
        )


def nested_too_deeply(label: str, kind: str) -> RobotError:
    """The error of a file that has too many elements inside one another."""
    return RobotError(
        f"{label}: the {kind} has more than {MOST_NESTED} elements inside one another; "
        "no robot needs them"
    )


def outermost_tag(text: str) -> str:
    """The tag of a file's outermost element, as far as it can be read; empty where it cannot."""
    parser: Any = ElementTree.XMLPullParser(("start",))
    for start in range(0, min(len(text), LIMIT), _PIECE):
        parser.feed(text[start : start + _PIECE])
        try:
            for _, element in parser.read_events():
                return str(element.tag)
        except ElementTree.ParseError:
            return ""
    return ""
