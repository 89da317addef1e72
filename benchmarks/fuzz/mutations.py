"""Faults that are put into files, at random but by seed."""

from __future__ import annotations

import random
import re
from typing import Final

NUMBERS: Final = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-0.0", "-1", "1e200", "abc", "",
    "0x10", "1,5", "1_0", "١", "1e", "--1", "1 2", "\t", "99999999999999999999",
)  # fmt: skip
"""What stands in place of a number."""
WORDS: Final = (
    "", "x" * 3000, "[bold]", "[/]", "a\nb", "=1+1", "<b>", "&amp;", "%s", "../../etc/passwd",
    "\u202e", "é", "{{}}", "'", '\\"', "#", ": ", "-", "none",
)  # fmt: skip
"""What stands in place of a name."""
_NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e-?\d+)?(?![\w.])")
_NAME = re.compile(r"(?<=\")[A-Za-z_][\w ]*(?=\")")


def mutated(text: str, seed: int) -> str:
    """A text with one to three faults."""
    chance = random.Random(seed)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        text = chance.choice(_FAULTS)(text, chance)
    return text


def damaged(data: bytes, seed: int) -> bytes:
    """Bytes with some of them changed, cut off, or put in twice."""
    chance = random.Random(seed)
    data = bytearray(data)  # type: ignore[assignment]
    kind = chance.randrange(5)
    at = chance.randrange(len(data))
    if kind == 0:
        return bytes(data[:at])
    if kind == 1:
        return bytes(data[:at] + data[at // 2 :])
    if kind == 2:
        return bytes(data[:at] + bytes(chance.randrange(256) for _ in range(20)) + data[at:])
    out = bytearray(data)
    for _ in range(chance.choice((1, 3, 30))):
        out[chance.randrange(len(out))] = chance.randrange(256)
    return bytes(out)


def _replaced(text: str, found: list[re.Match[str]], words: str, chance: random.Random) -> str:
    if not found:
        return text
    match = chance.choice(found)
    return text[: match.start()] + words + text[match.end() :]


def _number(text: str, chance: random.Random) -> str:
    return _replaced(text, list(_NUMBER.finditer(text)), chance.choice(NUMBERS), chance)


def _name(text: str, chance: random.Random) -> str:
    return _replaced(text, list(_NAME.finditer(text)), chance.choice(WORDS), chance)


def _line_away(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    del lines[chance.randrange(len(lines))]
    return "\n".join(lines)


def _line_twice(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    return "\n".join([*lines[:at], lines[at], *lines[at:]])


def _letter(text: str, chance: random.Random) -> str:
    at = chance.randrange(max(len(text), 1))
    return text[:at] + chance.choice("<>\"'/\0,;\n\ufeff 0-") + text[at + 1 :]


def _cut(text: str, chance: random.Random) -> str:
    return text[: chance.randrange(max(len(text), 1))]


_FAULTS: Final = (_number, _number, _number, _name, _name, _line_away, _line_twice, _letter, _cut)
