"""Footholds: what is held, what is refused and in which words, and the CSV round trip."""

from __future__ import annotations

import pickle
import re
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import FootholdsError
from gaitopt.terrain import footholds as module
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.foothold_csv import FARTHEST
from gaitopt.terrain.footholds import Footholds

HEADER = "leg,step,x,y,z"
coordinate = st.floats(-FARTHEST, FARTHEST)


@st.composite
def any_footholds(draw: st.DrawFn) -> Footholds:
    count = draw(st.integers(1, 4))
    point = st.tuples(coordinate, coordinate, coordinate)
    points = st.lists(point, min_size=count, max_size=count)
    return Footholds({leg: draw(points) for leg in LEGS})


def small(count: int = 2) -> dict[str, np.ndarray]:
    """Every coordinate of every foothold is another number."""
    values = np.arange(12.0 * count).reshape(4, count, 3) / 8
    return dict(zip(LEGS, values, strict=True))


def csv_lines(count: int = 2) -> list[str]:
    """Header on line 1, LF 0 on line 2, LF 1 on line 3, and so on."""
    return [HEADER] + [
        f"{leg},{k},{x},{y},{z}" for leg, p in small(count).items() for k, (x, y, z) in enumerate(p)
    ]


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str | bytes], Footholds]:
    """Reads text as if it were a CSV file called feet.csv."""

    def reading(content: str | bytes) -> Footholds:
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / "feet.csv").write_bytes(data)
        return Footholds.from_csv(tmp_path / "feet.csv")

    return reading


# --- what is held -----------------------------------------------------------------------------


def test_footholds_hold_what_they_were_given() -> None:
    feet = Footholds(small(3), radius=0.02)
    assert len(feet) == 3 and feet.steps == 8 and feet.radius == 0.02
    for leg in LEGS:
        np.testing.assert_array_equal(feet[leg], small(3)[leg])
    np.testing.assert_array_equal(feet.array, np.stack([small(3)[leg] for leg in LEGS]))


def test_legs_may_come_in_any_order_and_as_lists() -> None:
    shuffled = {leg: small()[leg].tolist() for leg in reversed(LEGS)}
    assert Footholds(shuffled) == Footholds(small())
    assert tuple(Footholds(shuffled).points) == LEGS


def test_arrays_are_copies_that_cannot_be_written() -> None:
    given_points = small()
    feet = Footholds(given_points)
    given_points["LF"][0, 0] = 99.0
    assert feet["LF"][0, 0] == 0.0
    for array in (feet["LF"], feet.array):
        with pytest.raises(ValueError, match="read-only"):
            array[..., 0] = 1.0
    with pytest.raises(TypeError):
        feet.points["LF"] = np.zeros((2, 3))  # type: ignore[index]
    with pytest.raises(AttributeError):
        feet.radius = 1.0  # type: ignore[misc]


def test_one_foothold_a_leg_is_standing_still() -> None:
    assert Footholds(small(1)).steps == 0


@pytest.mark.parametrize(
    ("radius", "text"),
    [
        (None, "Footholds(2 a leg, 4 steps, open ground)"),
        (0.02, "Footholds(2 a leg, 4 steps, columns of 40 mm)"),
    ],
)
def test_footholds_introduce_themselves(radius: float | None, text: str) -> None:
    assert repr(Footholds(small(), radius)) == text


def test_equality_is_of_every_coordinate_and_the_radius() -> None:
    moved = small()
    moved["RH"][1, 2] += 1e-15
    feet = Footholds(small(), 0.02)
    assert feet == Footholds(small(), 0.02)
    assert feet != Footholds(moved, 0.02)
    assert feet != Footholds(small())
    assert feet != Footholds(small(3), 0.02)
    assert feet != "feet"
    with pytest.raises(TypeError, match="unhashable"):
        hash(feet)


@given(any_footholds(), st.none() | st.floats(1e-3, 10.0))
def test_pickle_round_trip_is_exact(feet: Footholds, radius: float | None) -> None:
    original = Footholds(feet.points, radius)
    copy = pickle.loads(pickle.dumps(original))
    assert copy == original
    assert not copy["LF"].flags.writeable


def test_raised_moves_every_foothold_up_and_nothing_else() -> None:
    feet = Footholds(small(), 0.02)
    lifted = feet.raised(0.015)
    np.testing.assert_array_equal(lifted.array[..., :2], feet.array[..., :2])
    np.testing.assert_array_equal(lifted.array[..., 2], feet.array[..., 2] + 0.015)
    assert lifted.radius == 0.02
    assert feet == Footholds(small(), 0.02)


def test_raising_by_nan_is_refused() -> None:
    with pytest.raises(FootholdsError, match=r"height must be from -1e\+06 to 1e\+06 m, got nan"):
        Footholds(small()).raised(np.nan)


# --- what is refused --------------------------------------------------------------------------


def test_missing_and_unknown_legs_are_named() -> None:
    points = small()
    points["XX"] = points.pop("LF")
    del points["RH"]
    with pytest.raises(FootholdsError) as caught:
        Footholds(points)
    assert str(caught.value) == (
        "footholds are needed for the legs LF, LH, RH, RF; missing: LF, RH; unknown: XX"
    )


def test_legs_may_have_other_names() -> None:
    names = {"LF": "FL", "LH": "rear_left", "RH": "rr", "RF": "Front Right"}
    plain = Footholds(small())
    assert Footholds({names[leg]: p for leg, p in small().items()}) == plain
    assert all((plain[names[leg]] == plain[leg]).all() for leg in LEGS)
    with pytest.raises(FootholdsError, match=r"two of the names .*FL.* are of one leg"):
        Footholds({**small(), "FL": small()["LF"]})


def test_legs_may_have_other_names_in_a_csv(read: Reader) -> None:
    text = "\n".join(csv_lines())
    for leg, other in {"LF": "FL", "LH": "rear_left", "RH": "rr", "RF": "Front Right"}.items():
        text = text.replace(f"{leg},", f"{other},")
    assert "FL," in text and read(text) == read("\n".join(csv_lines()))


@pytest.mark.parametrize("shape", [(3,), (2, 2), (2, 4), (0, 3), (1, 2, 3), ()])
def test_wrong_shape_is_named_with_its_leg(shape: tuple[int, ...]) -> None:
    with pytest.raises(FootholdsError) as caught:
        Footholds({**small(), "LH": np.zeros(shape)})
    assert str(caught.value) == (
        f"footholds of LH must have the shape (n, 3) with n >= 1, got {shape}"
    )


@pytest.mark.parametrize(
    "points",
    [[[1, 2, 3], [1, 2]], [["a", "b", "c"]], [[1, 2, 3j]], [{}], [["1", "2", "3"]], [[0, 0, None]]],
)
def test_what_is_no_array_of_numbers_is_named_with_its_leg(points: list[object]) -> None:
    with pytest.raises(FootholdsError, match=r"^footholds of RF must be numbers, got "):
        Footholds({**small(), "RF": points})  # type: ignore[dict-item]


def test_unequal_numbers_are_listed() -> None:
    with pytest.raises(FootholdsError) as caught:
        Footholds({**small(2), "RH": small(3)["RH"]})
    assert str(caught.value) == (
        "every leg needs the same number of footholds, got LF 2, LH 2, RH 3, RF 2; or give the "
        "order of all steps"
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.1e6, -1e300])
@pytest.mark.parametrize("axis", range(3))
def test_coordinate_that_is_no_place_is_named(bad: float, axis: int) -> None:
    points = small()["LH"].tolist()
    points[1][axis] = bad
    with pytest.raises(FootholdsError) as caught:
        Footholds({**small(), "LH": points})
    assert str(caught.value) == (
        f"foothold 1 of LH is {points[1]}; coordinates must be finite and below 1e+06 m"
    )


def test_the_farthest_place_is_still_a_place() -> None:
    points = {leg: np.full((1, 3), FARTHEST) for leg in LEGS}
    assert Footholds(points)["LF"][0, 0] == FARTHEST


@pytest.mark.parametrize("radius", [0.0, -0.02, np.nan, np.inf])
def test_radius_must_be_a_length(radius: float) -> None:
    with pytest.raises(FootholdsError) as caught:
        Footholds(small(), radius)
    assert str(caught.value) == (
        f"radius must be a positive length of at most 1e+06 m, got {radius!r}"
    )


@pytest.mark.parametrize("kind", [np.asanyarray, list])
def test_footholds_that_a_mask_hides_are_refused(kind: Callable[[Any], Any]) -> None:
    hidden = np.ma.masked_equal(small()["LF"], 0.125)
    with pytest.raises(FootholdsError, match=r"^footholds of LF must be numbers, got "):
        Footholds({**small(), "LF": kind(hidden)})


@pytest.mark.parametrize("friction", [0.5, np.float32(0.5), np.array(0.5), Fraction(1, 2)])
def test_one_friction_is_that_of_all_footholds_under_any_name_of_a_leg(friction: Any) -> None:
    feet = Footholds(small(), friction=friction)
    assert feet.friction is not None
    assert feet.friction["front_left"].tolist() == [0.5, 0.5]


@pytest.mark.parametrize("friction", [np.nan, np.inf, 0.0, -1, 500, 10**400])
def test_friction_out_of_range_is_told_as_it_was_given(friction: float) -> None:
    with pytest.raises(FootholdsError) as caught:
        Footholds(small(), friction=friction)
    assert str(caught.value).startswith(f"friction must be from 0.001 to 10, got {friction!r}"[:80])


def test_friction_of_some_legs_and_of_no_numbers_is_refused_in_its_own_words() -> None:
    with pytest.raises(FootholdsError, match=r"^values of friction are needed .*; missing: LH, RH"):
        Footholds(small(), friction={"LF": [0.5, 0.5], "RF": [0.5, 0.5]})
    with pytest.raises(FootholdsError, match=r"^friction must be one number, or map LF, .*, got '"):
        Footholds(small(), friction="0.5")  # type: ignore[arg-type]
    with pytest.raises(
        FootholdsError, match=r"^friction of LF must be finite numbers, and 1 is na"
    ):
        Footholds(small(), friction={leg: [0.5, np.nan] for leg in LEGS})


def test_the_rest_of_a_walk_is_asked_for_under_any_name_of_a_leg() -> None:
    feet = Footholds(small(3))
    rest = feet.after({"FL": 1, "RL": 1, "RR": 1, "FR": 1}, LEGS)
    assert {leg: rest[leg].tolist() for leg in LEGS} == {
        leg: small(3)[leg][1:].tolist() for leg in LEGS
    }


# --- CSV --------------------------------------------------------------------------------------


@given(any_footholds())
def test_csv_round_trip_is_exact(feet: Footholds) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "feet.csv"
        feet.to_csv(path)
        assert Footholds.from_csv(path) == feet


@given(any_footholds(), st.floats(1e-6, 1e3))
def test_csv_keeps_the_columns_radius(feet: Footholds, radius: float) -> None:
    columns = Footholds(feet.points, radius)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "feet.csv"
        columns.to_csv(path)
        assert Footholds.from_csv(path) == columns
        assert Footholds.from_csv(path, radius=0.5).radius == 0.5


def test_the_radius_stands_in_a_comment_above_the_header(tmp_path: Path) -> None:
    feet = s_columns(seed=3, height_jitter=0.05)
    feet.to_csv(tmp_path / "s.csv")
    lines = (tmp_path / "s.csv").read_text().splitlines()
    assert lines[:2] == ["# column radius [m]: 0.02", HEADER]
    (tmp_path / "open.csv").write_text("\n".join(lines[1:]))
    assert Footholds.from_csv(tmp_path / "open.csv") == Footholds(feet.points)


@pytest.mark.parametrize(
    ("comment", "radius"),
    [
        ("# column radius [m]: 0.03", 0.03),
        ("#Column  Radius [m]:3e-2", 0.03),
        ('"# column radius [m]: 0.03",,,,', 0.03),
        ("# walked on a Tuesday", None),
        ("# walked on a Tuesday\n# column radius [m]: 0.03\n#", 0.03),
    ],
)
def test_comments_may_stand_above_the_header(
    read: Reader, comment: str, radius: float | None
) -> None:
    assert read("\n".join([comment, *csv_lines()])) == Footholds(small(), radius)


@pytest.mark.parametrize(
    ("comments", "complaint"),
    [
        (["# column radius [m]: wide"], "line 1: the column radius is no positive length"),
        (["# column radius [m]:"], "line 1: the column radius is no positive length"),
        (["# column radius [m]: -1"], "line 1: the column radius is no positive length"),
        (["# column radius [m]: nan"], "line 1: the column radius is no positive length"),
        (["#", "# column radius [m]: 1e9"], "line 2: the column radius is no positive length"),
        (["# column radius [m]: 1"] * 2, "line 2: the column radius stands there twice"),
        (["# one", "# two", "leg"], "line 3: the header must be leg,step,x,y,z, got leg"),
        (["# one", HEADER, "XX,0,0,0,0"], "line 3: leg 'XX' is unknown"),
    ],
)
def test_a_bad_line_under_comments_is_named_with_its_number(
    read: Reader, comments: list[str], complaint: str
) -> None:
    with pytest.raises(FootholdsError, match=re.escape(complaint)):
        read("\n".join([*comments, *csv_lines()]))


def test_open_ground_is_a_disc_of_the_papers_columns_size_around_each_foothold() -> None:
    assert Footholds(small()).landing_radius == s_columns(0).radius == 0.02
    assert Footholds(small(), 0.05).landing_radius == 0.05


def test_csv_is_plain_text_that_a_person_can_read(tmp_path: Path) -> None:
    Footholds({leg: [[0.1, -0.25, 0]] for leg in LEGS}).to_csv(tmp_path / "feet.csv")
    assert (tmp_path / "feet.csv").read_bytes() == (
        b"leg,step,x,y,z\nLF,0,0.1,-0.25,0.0\nLH,0,0.1,-0.25,0.0\n"
        b"RH,0,0.1,-0.25,0.0\nRF,0,0.1,-0.25,0.0\n"
    )


Reader = Callable[[str | bytes], Footholds]
EXPECTED = Footholds(small())


def spreadsheet(lines: list[str]) -> bytes:
    return ("\ufeff" + "\r\n".join(lines) + "\r\n").encode()


@pytest.mark.parametrize(
    "content",
    [
        "\n".join(csv_lines()),
        "\n".join(csv_lines()) + "\n",
        spreadsheet(csv_lines()),
        "\n".join([HEADER, *reversed(csv_lines()[1:])]),
        "\n\n".join(csv_lines()) + "\n\n\n",
        "\n".join([*csv_lines()[:4], ",,,,", "  ", *csv_lines()[4:]]),
        "\n".join(csv_lines()).replace(",", " ,  "),
        "\n".join(csv_lines()).replace(HEADER, "Leg, Step, X, Y, Z"),
        "\n".join(f'"{line.replace(",", chr(34) + "," + chr(34))}"' for line in csv_lines()),
    ],
    ids=["plain", "newline", "BOM", "shuffled", "blank", "empty", "spaces", "capitals", "quoted"],
)
def test_csv_may_be_written_by_any_hand(read: Reader, content: str | bytes) -> None:
    assert read(content) == EXPECTED


@pytest.mark.parametrize(
    ("line", "text", "complaint"),
    [
        (1, "leg,step,x,y", "the header must be leg,step,x,y,z, got leg,step,x,y"),
        (1, "leg;step;x;y;z", "the header must be leg,step,x,y,z, got leg;step;x;y;z"),
        (1, "LF,0,0.0,0.0,0.0", "the header must be leg,step,x,y,z, got lf,0,0.0,0.0,0.0"),
        (1, "", "the header must be leg,step,x,y,z, got nothing"),
        (3, "LF,1,0,0", "4 fields where 5 are needed (leg,step,x,y,z)"),
        (3, "LF,1,0,0,0,0", "6 fields where 5 are needed (leg,step,x,y,z)"),
        (4, "FL,0,0,0,0", "step 0 of leg LF stands there twice"),
        (
            4,
            "hind,0,0,0,0",
            "leg 'hind' is unknown; legs are LF, LH, RH, RF (FL, RL, RR, FR and "
            "front_left are understood, too)",
        ),
        (5, "LH,one,0,0,0", "step 'one' is no whole number"),
        (5, "LH,1.0,0,0,0", "step '1.0' is no whole number"),
        (5, "LH,,0,0,0", "step '' is no whole number"),
        (5, "LH,-1,0,0,0", "step -1 of leg LH is negative"),
        (5, "LH,0,0,0,0", "step 0 of leg LH stands there twice"),
        (6, "RH,0,0,abc,0", "y is 'abc', no number"),
        (6, "RH,0,,0,0", "x is '', no number"),
        (7, "RH,1,nan,0,0", "x is nan; it must be finite and below 1e+06 m"),
        (8, "RF,0,0,-inf,0", "y is -inf; it must be finite and below 1e+06 m"),
        (9, "RF,1,0,0,1e7", "z is 1e7; it must be finite and below 1e+06 m"),
        (9, f"RF,1,0,0,{'9' * 60}", f"z is {'9' * 20}; it must be finite and below 1e+06 m"),
    ],
)
def test_bad_line_is_named_with_its_number(
    read: Reader, tmp_path: Path, line: int, text: str, complaint: str
) -> None:
    lines = csv_lines()
    lines[line - 1] = text
    with pytest.raises(FootholdsError) as caught:
        read("\n".join(lines))
    assert str(caught.value) == f"{tmp_path / 'feet.csv'}, line {line}: {complaint}"


def test_line_numbers_count_blank_lines(read: Reader) -> None:
    with pytest.raises(FootholdsError, match=r"feet\.csv, line 5: leg 'XX' is unknown"):
        read("\n".join([HEADER, "", "LF,0,0,0,0", "", "XX,0,0,0,0"]))


def test_field_without_end_is_refused_with_its_line(read: Reader) -> None:
    with pytest.raises(FootholdsError, match=r"feet\.csv, line 2: field larger than"):
        read(HEADER + "\n" + "x" * 200_000)


def test_gap_in_the_steps_names_the_step(read: Reader, tmp_path: Path) -> None:
    lines = [line for line in csv_lines(4) if not line.startswith("RH,2,")]
    with pytest.raises(FootholdsError) as caught:
        read("\n".join(lines))
    assert str(caught.value) == (
        f"{tmp_path / 'feet.csv'}: leg RH has no step 2; steps count 0, 1, 2, ..."
    )


def test_steps_count_from_zero(read: Reader) -> None:
    with pytest.raises(FootholdsError, match="leg LF has no step 0; steps count 0, 1, 2"):
        read("\n".join(line for line in csv_lines() if not line.startswith("LF,0,")))


def test_leg_without_footholds_is_missed(read: Reader) -> None:
    with pytest.raises(FootholdsError, match="missing: RH"):
        read("\n".join(line for line in csv_lines() if not line.startswith("RH")))


def test_legs_with_unequal_footholds_are_counted(read: Reader) -> None:
    with pytest.raises(FootholdsError, match="got LF 2, LH 2, RH 2, RF 1"):
        read("\n".join(csv_lines()[:-1]))


def test_header_alone_is_no_terrain(read: Reader) -> None:
    with pytest.raises(FootholdsError, match="missing: LF, LH, RH, RF"):
        read(HEADER)


@pytest.mark.parametrize("length", range(0, len("\n".join(csv_lines())) - 1))
def test_file_cut_short_is_refused_or_lacks_only_digits(read: Reader, length: int) -> None:
    """Wherever the cut is, the footholds that are read have all their steps."""
    whole = "\n".join(csv_lines())
    try:
        feet = read(whole[:length])
    except FootholdsError:
        return
    assert whole[:length].startswith("\n".join(csv_lines()[:-1])) and len(feet) == 2


def test_binary_file_is_refused_where_it_begins(read: Reader) -> None:
    with pytest.raises(FootholdsError, match=r"feet\.csv is no text in UTF-8 \(byte 4\)$"):
        read(b"leg,\xff\xfe\x00")


def test_null_characters_are_refused(read: Reader) -> None:
    with pytest.raises(FootholdsError, match=r"feet\.csv, line 2: "):
        read(HEADER + "\nLF\0,0,0,0,0\n")


def test_file_over_the_limit_is_refused(read: Reader, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CSV_LIMIT", 100)
    with pytest.raises(FootholdsError, match="is larger than 0 MB, the most that is read"):
        read("\n".join(csv_lines()))


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FootholdsError) as caught:
        Footholds.from_csv(tmp_path / "none.csv")
    assert str(caught.value) == f"cannot read {tmp_path / 'none.csv'}: No such file or directory"


def test_folder_is_no_csv(tmp_path: Path) -> None:
    with pytest.raises(FootholdsError, match="Is a directory"):
        Footholds.from_csv(tmp_path)
