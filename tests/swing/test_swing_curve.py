"""What holds of every swing curve, whatever its shape."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from gaitopt.conventions import rotation_z
from gaitopt.errors import InputError
from gaitopt.swing.catalogue import SWING_CURVES, swing_curve
from gaitopt.swing.curve import ArchCurve, SwingCurve

START, END = np.array([0.3, -0.2, 0.05]), np.array([0.42, -0.13, 0.11])
ORDERS = ("position", "velocity", "acceleration", "jerk")
every_curve = pytest.mark.parametrize("name", SWING_CURVES)
every_arch = pytest.mark.parametrize("name", [n for n in SWING_CURVES if n != "box"])
few = settings(max_examples=30)
"""For each of the curves: three hundred examples of what holds of all of them."""

metre = st.integers(-(2 * 10**9), 2 * 10**9).map(lambda nanometres: nanometres * 1e-9)
place = st.tuples(metre, metre, metre).map(np.array)
height = st.just(0.0) | st.floats(1e-4, 0.5)
seconds = st.floats(0.05, 20.0)


def some(name: str, **other: Any) -> SwingCurve:
    return swing_curve(
        name, **{"start": START, "end": END, "height": 0.07, "duration": 0.6} | other
    )


def many(name: str, count: int = 50) -> SwingCurve:
    rng = np.random.default_rng(7)
    start = rng.uniform(-0.2, 0.2, (count, 3))
    end = start + rng.uniform(-0.3, 0.3, (count, 3))
    return swing_curve(name, start, end, rng.uniform(0.0, 0.2, count), rng.uniform(0.2, 3.0, count))


def samples(curve: SwingCurve, count: int = 101) -> np.ndarray:
    """Times over the whole swing, its breaks among them, along the first axis."""
    shares = np.linspace(0.0, 1.0, count).reshape(-1, *[1] * curve.duration.ndim)
    shares = np.broadcast_to(shares, (count, *curve.duration.shape))
    return np.sort(np.concatenate([shares, np.moveaxis(curve.breaks, -1, 0)]), axis=0) * (
        curve.duration
    )


# --- ends, apex, and what lies between


@every_curve
@few
@given(start=place, end=place, h=height, duration=seconds)
def test_foot_leaves_its_start_and_comes_to_its_end(
    name: str, start: np.ndarray, end: np.ndarray, h: float, duration: float
) -> None:
    curve = swing_curve(name, start, end, h, duration)
    np.testing.assert_array_equal(curve.position(0.0), start)
    np.testing.assert_array_equal(curve.position(duration), end)


@every_curve
@few
@given(start=place, end=place, h=height)
def test_apex_is_the_height_above_the_higher_end(
    name: str, start: np.ndarray, end: np.ndarray, h: float
) -> None:
    curve = swing_curve(name, start, end, h, 1.0)
    z = curve.position(samples(curve))[:, 2]
    assert curve.apex == max(start[2], end[2]) + h
    assert z.max() == pytest.approx(curve.apex, rel=0, abs=1e-15 * 8)
    assert z.min() == min(start[2], end[2])


@every_curve
@few
@given(start=place, end=place, h=height)
def test_foot_rises_to_its_apex_and_then_falls(
    name: str, start: np.ndarray, end: np.ndarray, h: float
) -> None:
    curve = swing_curve(name, start, end, h, 1.0)
    z = curve.position(samples(curve))[:, 2]
    top = int(z.argmax())
    assert (np.diff(z[: top + 1]) >= -1e-15).all() and (np.diff(z[top:]) <= 1e-15).all()


@every_curve
@few
@given(start=place, end=place, h=height)
def test_foot_never_goes_backwards_nor_leaves_the_straight_line_seen_from_above(
    name: str, start: np.ndarray, end: np.ndarray, h: float
) -> None:
    curve = swing_curve(name, start, end, h, 1.0)
    step = (end - start)[:2]
    seen = (curve.position(samples(curve)) - start)[:, :2]
    assert (np.diff(seen @ step) >= -1e-14).all()
    np.testing.assert_allclose(seen @ [-step[1], step[0]], 0.0, rtol=0, atol=1e-14)


@every_arch
@few
@given(start=place, end=place, h=height)
def test_in_the_half_at_the_higher_end_the_foot_is_never_below_it(
    name: str, start: np.ndarray, end: np.ndarray, h: float
) -> None:
    curve = swing_curve(name, start, end, h, 1.0)
    half = np.linspace(0.0, 0.5, 100) + (0.5 if end[2] > start[2] else 0.0)
    assert (curve.position(half)[:, 2] >= max(start[2], end[2]) - 1e-15).all()
    assert curve.position(0.5)[2] == pytest.approx(curve.apex, rel=0, abs=1e-15 * 8)


@every_curve
def test_stepping_on_one_spot_is_straight_up_and_down(name: str) -> None:
    curve = some(name, end=START)
    foot = curve.position(samples(curve))
    np.testing.assert_array_equal(foot[:, :2], np.broadcast_to(START[:2], foot[:, :2].shape))
    assert curve.length == pytest.approx(0.14, rel=1e-6)


@every_curve
def test_without_height_between_level_ends_the_foot_slides(name: str) -> None:
    curve = some(name, end=[0.7, 0.1, 0.05], height=0.0)
    assert set(curve.position(samples(curve))[:, 2]) == {0.05}
    assert curve.length == pytest.approx(0.5, rel=1e-12)


@every_curve
def test_a_foot_that_neither_steps_nor_lifts_stands_still(name: str) -> None:
    curve = some(name, end=START, height=0.0)
    times = samples(curve)
    np.testing.assert_array_equal(curve.position(times), np.broadcast_to(START, (len(times), 3)))
    for order in ORDERS[1:]:
        assert not getattr(curve, order)(times).any()
    assert curve.length == curve.peak_speed == 0.0


# --- derivatives


def pieces(curve: SwingCurve) -> tuple[np.ndarray, np.ndarray]:
    """Times in each piece between breaks ``(pieces, n, swings)``, and the pieces' durations."""
    flat = curve.breaks.T * curve.duration
    cuts = np.concatenate([0.0 * flat[:1], flat, 0.0 * flat[:1] + curve.duration])
    widths = np.diff(cuts, axis=0)[:, None]
    return cuts[:-1, None] + widths * np.linspace(0.07, 0.93, 23)[:, None], widths


@every_curve
@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_numerical_differentiation(name: str, order: int) -> None:
    """By central differences of eighth order within each analytic piece."""
    curve = many(name)
    times, widths = pieces(curve)
    step = 0.015 * widths
    function = getattr(curve, ORDERS[order - 1])
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    judge = sum(
        w * (function(times + k * step) - function(times - k * step)) / step[..., None]
        for k, w in weights.items()
    )
    exact = getattr(curve, ORDERS[order])(times)
    error = np.abs(judge - exact).max(axis=(1, 3))
    rounding = np.abs(function(times)).max(axis=(1, 3)) / step[:, 0]
    assert (error <= 1e-9 * np.abs(exact).max(axis=(0, 1, 3)) + 1e-14 * rounding).all()


@every_curve
def test_curve_is_as_smooth_as_it_says(name: str) -> None:
    """On both sides of each break a derivative differs only by what the next one makes of it."""
    curve, apart = many(name, 500), 1e-9
    breaks = np.moveaxis(curve.breaks, -1, 0)
    before, after = (breaks - apart) * curve.duration, (breaks + apart) * curve.duration
    for order in range(curve.smoothness + 1):
        function, slope = (getattr(curve, ORDERS[k]) for k in (order, order + 1))
        jump = np.abs(function(after) - function(before))
        steepest = np.maximum(np.abs(slope(before)), np.abs(slope(after)))
        rounding = 1e-14 * (1.0 + np.abs(function(after)))
        assert (jump <= 2.01 * apart * steepest * curve.duration[:, None] + rounding).all()


@every_curve
def test_curve_is_no_smoother_than_it_says(name: str) -> None:
    curve = some(name, duration=1.0)
    function = getattr(curve, ORDERS[curve.smoothness + 1])
    jumps = np.abs(function(curve.breaks + 1e-9) - function(curve.breaks - 1e-9)).max(axis=-1)
    assert jumps.max() > 0.1


@every_arch
@pytest.mark.parametrize("order", [1, 2, 3])
def test_between_level_ends_velocity_acceleration_and_jerk_pass_the_apex(
    name: str, order: int
) -> None:
    curve = some(name, end=[0.42, -0.13, 0.05], duration=1.0)
    function = getattr(curve, ORDERS[order])
    np.testing.assert_allclose(function(0.5 - 1e-9), function(0.5 + 1e-9), rtol=0, atol=1e-5)


@every_curve
def test_foot_rests_at_its_ends_as_far_as_it_says(name: str) -> None:
    curve = many(name)
    for t in (0.0 * curve.duration, curve.duration):
        for order in range(1, curve.rest_order + 1):
            assert not getattr(curve, ORDERS[order])(t).any()
        assert (getattr(curve, ORDERS[curve.rest_order + 1])(t) != 0.0).any(axis=-1).all()


# --- symmetries


@every_curve
@few
@given(start=place, end=place, h=height, duration=seconds)
def test_walking_back_is_the_same_curve_reversed(
    name: str, start: np.ndarray, end: np.ndarray, h: float, duration: float
) -> None:
    there, back = (swing_curve(name, *ends, h, duration) for ends in ((start, end), (end, start)))
    t = np.linspace(0.0, duration, 41)
    np.testing.assert_allclose(there.position(t), back.position(duration - t), rtol=0, atol=1e-14)
    np.testing.assert_allclose(there.breaks, 1.0 - back.breaks[::-1], rtol=0, atol=1e-15)
    assert there.length == pytest.approx(back.length, rel=1e-14)
    assert there.peak_speed == pytest.approx(back.peak_speed, rel=1e-14)


@every_curve
@few
@given(factor=st.floats(0.1, 10.0))
def test_a_swing_of_twice_the_duration_is_half_as_fast(name: str, factor: float) -> None:
    curve = some(name)
    slow = replace(curve, duration=factor * curve.duration)
    t = np.linspace(0.01, 0.58, 60)  # not at a break, whose side rounding would choose
    for order, quantity in enumerate(ORDERS):
        np.testing.assert_allclose(
            getattr(slow, quantity)(factor * t) * factor**order,
            getattr(curve, quantity)(t),
            rtol=0,
            atol=1e-11 * 10**order,
        )
    assert slow.peak_speed == pytest.approx(curve.peak_speed / factor, rel=1e-14)
    assert slow.length == pytest.approx(curve.length, rel=1e-14)
    np.testing.assert_array_equal(slow.breaks, curve.breaks)


@every_curve
@few
@given(factor=st.floats(0.1, 10.0))
def test_a_larger_robot_swings_the_same_curve_larger(name: str, factor: float) -> None:
    curve = some(name)
    large = replace(curve, start=factor * START, end=factor * END, height=factor * 0.07)
    t = np.linspace(0.0, 0.6, 61)
    np.testing.assert_allclose(large.position(t), factor * curve.position(t), rtol=0, atol=1e-14)
    assert large.peak_speed == pytest.approx(factor * curve.peak_speed, rel=1e-6)
    assert large.length == pytest.approx(factor * curve.length, rel=1e-6)


@every_curve
@few
@given(angle=st.floats(-np.pi, np.pi), move=place)
def test_curve_does_not_depend_on_place_or_heading(
    name: str, angle: float, move: np.ndarray
) -> None:
    curve, turn = some(name), rotation_z(angle)
    moved = replace(curve, start=turn @ START + move, end=turn @ END + move)
    t = np.linspace(0.0, 0.6, 61)
    np.testing.assert_allclose(
        moved.position(t), curve.position(t) @ turn.T + move, rtol=0, atol=1e-14
    )
    assert moved.peak_speed == pytest.approx(curve.peak_speed, rel=1e-6)
    assert moved.length == pytest.approx(curve.length, rel=1e-6)


# --- peak speed and length


@every_curve
@few
@given(start=place, end=place, h=height, duration=seconds)
def test_peak_speed_is_the_largest_speed(
    name: str, start: np.ndarray, end: np.ndarray, h: float, duration: float
) -> None:
    """Against an optimiser, started from the best of many samples."""
    curve = swing_curve(name, start, end, h, duration)
    times = samples(curve, 2001)
    speeds = np.linalg.norm(curve.velocity(times), axis=-1)
    best = int(speeds.argmax())
    found = minimize_scalar(
        lambda t: -np.linalg.norm(curve.velocity(t)),
        bounds=(times[max(best - 1, 0)], times[min(best + 1, len(times) - 1)]),
        method="bounded",
        options={"xatol": 1e-9 * duration},
    )
    fastest = max(speeds[best], -found.fun)
    assert fastest * (1.0 - 1e-6) <= curve.peak_speed <= fastest * (1.0 + 1e-9)


@every_arch
def test_laws_are_gentle_enough_for_the_bound_of_the_peak_speed(name: str) -> None:
    """The jerk of each law is at most 128 times its largest speed, as ``peak_speed`` says."""
    t = np.linspace(0.0, 1.0, 10001)
    for end, h in (([1.0, 0.0, 0.0], 0.0), ([0.0, 0.0, 0.0], 1.0), ([0.0, 0.0, 1.0], 0.0)):
        law = swing_curve(name, np.zeros(3), end, h, 1.0)
        jerk = np.abs(law.jerk(t)).max()
        assert jerk <= 128.0 * np.abs(law.velocity(t)).max() * (1.0 + 1e-12)


@every_curve
def test_length_is_that_of_a_fine_polygon(name: str) -> None:
    curve = many(name)
    edges = np.diff(curve.position(samples(curve, 20001)), axis=0)
    polygon = np.linalg.norm(edges, axis=-1).sum(axis=0)
    assert (polygon <= curve.length * (1.0 + 1e-6)).all()
    np.testing.assert_allclose(polygon, curve.length, rtol=2e-6)


@every_curve
@few
@given(start=place, end=place, h=height)
def test_no_curve_is_shorter_than_the_way_over_its_apex(
    name: str, start: np.ndarray, end: np.ndarray, h: float
) -> None:
    """And none longer than the box."""
    curve = swing_curve(name, start, end, h, 1.0)
    up_and_down = 2.0 * float(curve.apex) - start[2] - end[2]
    across = float(np.hypot(*(end - start)[:2]))
    assert curve.length >= np.hypot(across, up_and_down) * (1.0 - 1e-6)
    assert curve.length <= (across + up_and_down) * (1.0 + 1e-6)
    assert curve.peak_speed >= curve.length * (1.0 - 1e-5)  # nothing is covered faster, in 1 s


# --- many at once, and what is refused


@every_curve
def test_many_swings_at_once_are_the_swings_one_by_one(name: str) -> None:
    curve = many(name, 6)
    t = np.random.default_rng(1).uniform(0.0, 0.2, (5, 6))
    for order in ORDERS:
        together = getattr(curve, order)(t)
        assert together.shape == (5, 6, 3)
        for i in range(6):
            alone = swing_curve(
                name, curve.start[i], curve.end[i], curve.height[i], curve.duration[i]
            )
            np.testing.assert_array_equal(together[:, i], getattr(alone, order)(t[:, i]))
            assert curve.length[i] == pytest.approx(alone.length, rel=1e-14)
            assert curve.peak_speed[i] == pytest.approx(alone.peak_speed, rel=1e-14)
            np.testing.assert_array_equal(curve.breaks[i], alone.breaks)


@every_curve
def test_fields_are_broadcast_and_read_only(name: str) -> None:
    start, heights = np.zeros((4, 1, 3)), np.array([0.05, 0.1])
    curve = swing_curve(name, start, END, heights, 0.5)
    assert curve.start.shape == curve.end.shape == (4, 2, 3)
    assert curve.height.shape == curve.duration.shape == curve.apex.shape == (4, 2)
    assert curve.peak_speed.shape == curve.length.shape == curve.breaks.shape[:-1] == (4, 2)
    assert curve.position(np.linspace(0, 0.5, 9)[:, None, None]).shape == (9, 4, 2, 3)
    start[...] = 9.0
    assert not curve.start.any()
    with pytest.raises(ValueError, match="read-only"):
        curve.start[...] = 1.0


@every_curve
def test_no_swing_at_all_has_no_answers(name: str) -> None:
    curve = swing_curve(name, np.zeros((0, 3)), np.ones((0, 3)), 0.1, 1.0)
    assert curve.position(0.5).shape == (0, 3)
    assert curve.peak_speed.shape == curve.length.shape == (0,)


@every_curve
def test_thousands_of_swings_have_the_peak_speeds_of_each(name: str) -> None:
    few = many(name, 7)
    lots = swing_curve(
        name, *(np.tile(e, (500, 1)) for e in (few.start, few.end)), np.tile(few.height, 500),
        np.tile(few.duration, 500),
    )  # fmt: skip
    np.testing.assert_allclose(lots.peak_speed, np.tile(few.peak_speed, 500), rtol=1e-14)


@every_curve
def test_times_outside_the_swing_are_moved_to_its_ends(name: str) -> None:
    curve = some(name)
    for order in ORDERS:
        function = getattr(curve, order)
        np.testing.assert_array_equal(function([-1.0, 99.0]), function([0.0, 0.6]))
    with pytest.raises(InputError, match="t must be numbers, and one is NaN"):
        curve.position([np.nan])


def test_times_of_another_count_than_the_swings_are_refused() -> None:
    with pytest.raises(InputError) as caught:
        many("cycloid", 4).position(np.zeros(3))
    assert str(caught.value) == (
        "times (3,) do not go with swings (4,); give times (N, 1) for N times of each of M swings"
    )


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("start", [0.0, 0.0], "start must have the shape (..., 3), got (2,)"),
        ("end", 0.0, "end must have the shape (..., 3), got ()"),
        (
            "end",
            [[0, 0, 0], [0, np.nan, 0]],
            "end must be from -1e+06 to 1e+06 m, got nan at index (1, 1)",
        ),
        ("start", "here", "start must be numbers [m], got 'here'"),
        ("height", -0.01, "height must be from 0 to 100 m, got -0.01"),
        ("height", None, "height must be numbers [m], got None"),
        ("duration", 0.0, "duration must be from 1e-06 to 1e+06 s, got 0"),
        (
            "duration",
            [1.0, np.inf],
            "duration must be from 1e-06 to 1e+06 s, got inf at index (1,)",
        ),
    ],
)
def test_nonsense_is_refused_with_the_field_and_the_number(
    field: str, value: object, message: str
) -> None:
    with pytest.raises(InputError) as caught:
        some("cycloid", **{field: value})
    assert str(caught.value) == message


def test_fields_of_different_counts_are_refused() -> None:
    with pytest.raises(InputError) as caught:
        some("cycloid", start=np.zeros((2, 3)), height=[0.1, 0.1, 0.1])
    assert str(caught.value) == (
        "start, end, height and duration must each be given for one swing or for as many as the "
        "others, got (2,), (), (3,), ()"
    )


def test_a_form_without_a_shape_is_no_curve() -> None:
    for form in (SwingCurve, ArchCurve):
        with pytest.raises(TypeError, match="abstract"):
            form(START, END, 0.07, 0.6)  # type: ignore[abstract,arg-type]
