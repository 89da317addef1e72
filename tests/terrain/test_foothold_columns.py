"""CSV files of footholds with normals, friction, swing heights, order and postures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds
from gaitopt.errors import FootholdsError
from gaitopt.terrain.foothold_columns import FURTHER

ORDER = ("RH", "RF", "LH", "RF", "LF", "RF")


def anything(seed: int = 0, **kept: bool) -> Footholds:
    """Footholds with all that a file may tell of them, in numbers that have no short text."""
    random = np.random.default_rng(seed)
    counts = {leg: ORDER.count(leg) + 1 for leg in LEGS}
    normals = {leg: random.normal(size=(n, 3)) * 0.3 + [0.0, 0.0, 1.0] for leg, n in counts.items()}
    further = {
        "normals": {
            leg: n / np.linalg.norm(n, axis=1, keepdims=True) for leg, n in normals.items()
        },
        "friction": {leg: random.uniform(0.1, 1.0, n) for leg, n in counts.items()},
        "swing_heights": {leg: random.uniform(0.0, 0.2, n - 1) for leg, n in counts.items()},
        "postures": random.normal(size=(len(ORDER) + 1, 4)),
        "body_places": random.normal(size=(len(ORDER) + 1, 2)),
    }
    return Footholds(
        {leg: random.normal(size=(n, 3)) for leg, n in counts.items()}, 0.02, order=ORDER,
        **{name: value for name, value in further.items() if kept.get(name, True)},
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(20))
def test_files_keep_every_number(tmp_path: Path, seed: int) -> None:
    footholds = anything(seed)
    footholds.to_csv(tmp_path / "feet.csv")
    header = (tmp_path / "feet.csv").read_text().splitlines()[1]
    assert header == ",".join(["leg,step,x,y,z", *FURTHER])
    assert Footholds.from_csv(tmp_path / "feet.csv") == footholds


@pytest.mark.parametrize(
    "name", ["normals", "friction", "swing_heights", "postures", "body_places"]
)
def test_columns_may_be_left_out(tmp_path: Path, name: str) -> None:
    footholds = anything(**{name: False})
    footholds.to_csv(tmp_path / "feet.csv")
    assert Footholds.from_csv(tmp_path / "feet.csv") == footholds


def test_normals_that_are_unit_vectors_are_kept_to_the_last_bit() -> None:
    """Dividing by a length that is 1 within rounding would change some of them."""
    footholds = anything()
    assert footholds.normals is not None
    again = footholds.with_(normals=footholds.normals)
    for _ in range(3):
        again = again.with_(normals=again.normals)
    assert again == footholds


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    footholds = anything()
    footholds.to_csv(tmp_path / "feet.csv")
    comment, *lines = (tmp_path / "feet.csv").read_text().splitlines()
    turned = [",".join([*cells[:5], *cells[:4:-1]]) for cells in (x.split(",") for x in lines)]
    (tmp_path / "turned.csv").write_text("\n".join([comment, *turned]))
    assert Footholds.from_csv(tmp_path / "turned.csv") == footholds


def test_a_walk_over_footholds_from_a_file_is_the_same(
    tmp_path: Path, wang: gaitopt.Quadruped
) -> None:
    from turning import on_the_spot

    footholds = on_the_spot(wang, 1, 0.2)
    footholds.to_csv(tmp_path / "feet.csv")
    plans = [
        gaitopt.plan_crawl(wang, f, timing="velocity")
        for f in (footholds, Footholds.from_csv(tmp_path / "feet.csv"))
    ]
    np.testing.assert_array_equal(*(p.path.coefficients[-1] for p in plans))


def changed(tmp_path: Path, line: int, column: str, text: str) -> Path:
    """The file of :func:`anything` with another text in one field; line 1 is the comment."""
    anything().to_csv(tmp_path / "feet.csv")
    lines = (tmp_path / "feet.csv").read_text().splitlines()
    cells = lines[line - 1].split(",")
    cells[lines[1].split(",").index(column)] = text
    lines[line - 1] = ",".join(cells)
    (tmp_path / "feet.csv").write_text("\n".join(lines))
    return tmp_path / "feet.csv"


@pytest.mark.parametrize(
    ("line", "column", "text", "complaint"),
    [
        (2, "friction", "grip", "line 2: the column 'grip' is unknown; after leg,step,x,y,z there"),
        (2, "friction", "nx", "line 2: a column is there twice"),
        (4, "friction", "", "line 4: friction is missing"),
        (4, "nx", "inf", "line 4: nx is inf; it must be finite and below 1e+06 m"),
        (4, "nx", "0.9", "normal 1 of LF is"),
        (4, "swing_height", "high", "line 4: swing_height is 'high', no number"),
        (3, "swing_height", "0.1", "line 3: swing_height is empty in step 0"),
        (3, "turn", "0", "line 3: turn is empty in step 0"),
        (4, "turn", "0", "line 8: turn is 0; turns count the steps of all legs from 0"),
        (4, "turn", "1.5", "line 4: turn is 1.5"),
        (4, "turn", "9", "no step has the turn 4"),
        (
            5,
            "yaw",
            "0.25",
            "line 5: in step 0 body_height, roll, pitch, yaw are those",
        ),
    ],
)
def test_what_is_wrong_is_told_with_its_line(
    tmp_path: Path, line: int, column: str, text: str, complaint: str
) -> None:
    with pytest.raises(FootholdsError, match=re.escape(complaint)):
        Footholds.from_csv(changed(tmp_path, line, column, text))


@pytest.mark.parametrize(
    ("header", "complaint"),
    [
        ("leg,step,x,y,z,nx,ny", "line 1: the columns nx,ny,nz go together"),
        ("leg,step,x,y,z,yaw", "line 1: the columns body_height,roll,pitch,yaw go together"),
    ],
)
def test_groups_of_columns_go_together(tmp_path: Path, header: str, complaint: str) -> None:
    (tmp_path / "feet.csv").write_text(header + "\n")
    with pytest.raises(FootholdsError, match=re.escape(complaint)):
        Footholds.from_csv(tmp_path / "feet.csv")


def test_postures_need_turns(tmp_path: Path) -> None:
    rows = [f"{leg},0,0,0,0,0.4,0,0,0" for leg in LEGS]
    text = "\n".join(["leg,step,x,y,z,body_height,roll,pitch,yaw", *rows])
    (tmp_path / "feet.csv").write_text(text)
    with pytest.raises(FootholdsError, match="go with the column turn"):
        Footholds.from_csv(tmp_path / "feet.csv")
