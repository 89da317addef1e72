"""Columns of footholds in CSV text beside leg, step and place: the ground, the order, the body.

A column may be left out. Those of one group go together.

* ``nx``, ``ny``, ``nz``: the unit normal of the ground; ``friction``: its coefficient.
* ``swing_height``: how far the foot rises on its way to this foothold [m]; empty in step 0.
* ``turn``: which step of the whole walk leads to this foothold, from 0 on; empty in step 0.
* ``body_height``, ``roll``, ``pitch``, ``yaw``: of the body during this step; in step 0 at the
  start, the same of all legs.
* ``body_x``, ``body_y``: where the body centre is wanted, in the same lines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import FootholdsError

NORMAL: Final = ("nx", "ny", "nz")
POSTURE: Final = ("body_height", "roll", "pitch", "yaw")
BODY_PLACE: Final = ("body_x", "body_y")
FURTHER: Final = (*NORMAL, "friction", "swing_height", "turn", *POSTURE, *BODY_PLACE)
"""All columns beside those of leg, step and place."""
GROUPS: Final = (NORMAL, POSTURE, BODY_PLACE)
"""Columns that go together."""


class Row(NamedTuple):
    """A line of a table of footholds.

    Attributes:
        place: ``(x, y, z)`` [m].
        further: numbers by column; ``None`` for an empty field.
        where: file and line, for messages.
    """

    place: list[float]
    further: Mapping[str, float | None]
    where: str


class FootholdTable(NamedTuple):
    """What CSV text holds; the fields are those of :class:`gaitopt.Footholds`."""

    points: Mapping[str, FloatArray]
    radius: float | None = None
    normals: Mapping[str, FloatArray] | None = None
    friction: Mapping[str, FloatArray] | None = None
    order: tuple[str, ...] | None = None
    swing_heights: Mapping[str, FloatArray] | None = None
    postures: FloatArray | None = None
    body_places: FloatArray | None = None


def further_cells(table: FootholdTable) -> dict[str, dict[str, list[str]]]:
    """The text of all further columns: by column, then by leg, one for each foothold."""
    columns: dict[str, dict[str, list[str]]] = {}
    if table.normals is not None:
        for i, name in enumerate(NORMAL):
            columns[name] = {leg: _texts(n[:, i]) for leg, n in table.normals.items()}
    if table.friction is not None:
        columns["friction"] = {leg: _texts(f) for leg, f in table.friction.items()}
    if table.swing_heights is not None:
        columns["swing_height"] = {leg: ["", *_texts(h)] for leg, h in table.swing_heights.items()}
    if table.order is not None:
        turns = {leg: [s for s, other in enumerate(table.order) if other == leg] for leg in LEGS}
        columns["turn"] = {leg: ["", *map(str, own)] for leg, own in turns.items()}
        for names, values in ((POSTURE, table.postures), (BODY_PLACE, table.body_places)):
            if values is not None:
                for i, name in enumerate(names):
                    columns[name] = {
                        leg: _texts(values[[0, *(turn + 1 for turn in own)], i])
                        for leg, own in turns.items()
                    }
    return columns


def table_of(
    rows: Mapping[str, Sequence[Row]], columns: Sequence[str], radius: float | None
) -> FootholdTable:
    """A table from its lines.

    Args:
        rows: by leg, in the order of its steps.
        columns: that are there, beside those of leg, step and place.
        radius: of the columns that feet stand on [m].

    Raises:
        FootholdsError: a number is missing, or is one too many; names the line.
    """

    def column(name: str, first: int) -> dict[str, FloatArray]:
        return {leg: np.array([_number(r, name) for r in own[first:]]) for leg, own in rows.items()}

    for own in rows.values():
        for name in {"swing_height", "turn"} & set(columns):
            if own[0].further[name] is not None:
                raise FootholdsError(
                    f"{own[0].where}: {name} is empty in step 0, to which no step leads"
                )
    given = set(columns)
    order = _order(rows) if "turn" in given else None
    of_steps: dict[tuple[str, ...], FloatArray | None] = {POSTURE: None, BODY_PLACE: None}
    for names in of_steps:
        if names[0] not in given:
            continue
        if order is None:
            raise FootholdsError(f"columns {', '.join(names)} go with the column turn")
        of_steps[names] = _of_steps(rows, order, names)
    normals = [column(name, 0) for name in NORMAL if name in given]
    return FootholdTable(
        points={leg: np.array([r.place for r in own]) for leg, own in rows.items()},
        radius=radius,
        normals={leg: np.stack([n[leg] for n in normals], axis=1) for leg in rows}
        if normals
        else None,
        friction=column("friction", 0) if "friction" in given else None,
        order=None if order is None else tuple(order),
        swing_heights=column("swing_height", 1) if "swing_height" in given else None,
        postures=of_steps[POSTURE],
        body_places=of_steps[BODY_PLACE],
    )


def _texts(values: FloatArray) -> list[str]:
    """Numbers as texts from which reading gives them back exactly."""
    return [repr(float(value)) for value in values]


def _number(row: Row, name: str) -> float:
    value = row.further[name]
    if value is None:
        raise FootholdsError(f"{row.where}: {name} is missing")
    return value


def _order(rows: Mapping[str, Sequence[Row]]) -> list[str]:
    """The legs in the order of their steps."""
    taken: dict[int, str] = {}
    for leg, own in rows.items():
        before = -1
        for row in own[1:]:
            turn = _number(row, "turn")
            if turn != int(turn) or not before < turn or int(turn) in taken:
                raise FootholdsError(
                    f"{row.where}: turn is {turn:g}; turns count the steps of all legs from 0, "
                    "each once, and grow from step to step of a leg"
                )
            before = int(turn)
            taken[before] = leg
    missing = [s for s in range(len(taken)) if s not in taken]
    if missing:
        raise FootholdsError(
            f"no step has the turn {missing[0]}; turns count the steps of all legs 0, 1, 2, ..."
        )
    return [taken[s] for s in range(len(taken))]


def _of_steps(
    rows: Mapping[str, Sequence[Row]], order: Sequence[str], names: Sequence[str]
) -> FloatArray:
    """Columns of the body at the start and during each step ``(S + 1, n)`` [m, rad]."""
    starts = [[_number(own[0], name) for name in names] for own in rows.values()]
    for own, start in zip(rows.values(), starts, strict=True):
        if start != starts[0]:
            raise FootholdsError(
                f"{own[0].where}: in step 0 {', '.join(names)} are those of the start, the same "
                "of all legs"
            )
    out = [starts[0]]
    made = dict.fromkeys(rows, 0)
    for leg in order:
        made[leg] += 1
        out.append([_number(rows[leg][made[leg]], name) for name in names])
    return np.array(out)
