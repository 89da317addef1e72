"""What a plan says of itself, and its file."""

from __future__ import annotations

import dataclasses
import json
import pickle
import re
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import InputError, Plan, PlanFileError
from gaitopt.plan import archive as storage
from gaitopt.plan.phase import Limit
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.plan.settings.time_optimal import RouteSettings


def same(a: Plan, b: Plan) -> bool:
    """Whether two plans are equal to the last bit."""

    def equal(x: Any, y: Any) -> bool:
        if isinstance(x, np.ndarray):
            return x.dtype == y.dtype and np.array_equal(x, y)
        if dataclasses.is_dataclass(x):
            return all(equal(getattr(x, f.name), getattr(y, f.name))
                       for f in dataclasses.fields(x))  # fmt: skip
        return bool(x == y)

    return (
        a.robot.urdf == b.robot.urdf
        and a.robot.name == b.robot.name
        and a.footholds == b.footholds
        and a.settings == b.settings
        and len(a.phases) == len(b.phases)
        and all(equal(p, q) for p, q in zip(a.phases, b.phases, strict=True))
        and np.array_equal(a.path.times, b.path.times)
        and np.array_equal(a.path.coefficients, b.path.coefficients)
        and a.record == b.record
    )


def rewritten(source: Path, target: Path, **changes: Any) -> Path:
    """A copy of a plan file with entries of its header changed."""
    with np.load(source) as stored:
        arrays = {key: stored[key] for key in stored}
    header = json.loads(arrays["header"].tobytes())
    header.update(changes)
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    np.savez(target, **arrays)
    return target


def test_only_a_stride_is_told_of_obstacles() -> None:
    board = gaitopt.rectangular_obstacle(0.11, 0.04)
    assert StrideSettings(obstacles=(board,)).obstacles == (board,)
    for kind in (CrawlSettings, GaitSettings, RouteSettings, StrideSettings):
        settings = kind()
        assert settings.obstacles == ()
        assert ("obstacles" in settings.to_dict()) == (kind is StrideSettings)


def test_velocities_are_the_rates_of_the_configurations(plan: Plan) -> None:
    """Pinocchio integrates q by v to the next q, between knots where v is constant."""
    rng = np.random.default_rng(1)
    times, h = plan.path.times, 1e-6
    middle = (times[1:] + times[:-1]) / 2
    chosen = rng.choice(np.flatnonzero(np.diff(times) > 4 * h), 50, replace=False)
    a, b = plan.at(middle[chosen]), plan.at(middle[chosen] + h)
    for q, v, after in zip(a.q, a.v, b.q, strict=True):
        assert pin.integrate(plan.robot.model, q, v * h) == pytest.approx(after, abs=1e-12)


def test_samples_are_read_only_and_end_at_the_end(plan: Plan) -> None:
    motion = plan.sample(0.5)
    assert motion.t[0] == 0.0 and motion.t[-1] == plan.duration
    assert np.diff(motion.t)[:-1] == pytest.approx(0.5)
    shapes = {name: getattr(motion, name).shape for name in ("q", "v", "contacts", "cog", "feet")}
    n = len(motion.t)
    assert shapes == {"q": (n, 19), "v": (n, 18), "contacts": (n, 4), "cog": (n, 3),
                      "feet": (n, 4, 3)}  # fmt: skip
    assert motion.legs == ("LF", "LH", "RH", "RF")
    assert motion.joint_names == plan.robot.joint_names
    for name in ("t", *shapes):
        with pytest.raises(ValueError, match="read-only"):
            getattr(motion, name)[0] = 0


def test_a_sample_that_divides_the_duration_is_not_doubled(short_plan: Plan) -> None:
    motion = short_plan.sample(short_plan.duration / 10)
    assert len(motion) == 11


@pytest.mark.parametrize("dt", [0.0, -1.0, float("nan"), float("inf"), 1e-9, True])
def test_bad_sampling_times(plan: Plan, dt: float) -> None:
    with pytest.raises(InputError, match="dt"):
        plan.sample(dt)


def test_times_outside_the_plan_are_refused(plan: Plan) -> None:
    for times in ([-1.0], [plan.duration + 1], [np.nan], [[0.0]]):
        with pytest.raises(InputError, match="times must be"):
            plan.at(times)


def test_phases_are_found_by_time(plan: Plan) -> None:
    for phase in plan.phases:
        if phase.duration > 0:
            assert plan.phase_at(phase.start + phase.duration / 2) is phase


def test_a_plan_survives_its_file(plan: Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "plan.npz")
    assert same(gaitopt.load_plan(tmp_path / "plan.npz"), plan)
    assert [p.name for p in tmp_path.iterdir()] == ["plan.npz"]


def test_a_plan_survives_pickling(short_plan: Plan) -> None:
    assert same(pickle.loads(pickle.dumps(short_plan)), short_plan)


def test_a_plan_of_no_steps_survives_its_file(tmp_path: Path) -> None:
    robot = gaitopt.load_robot("wang2020")
    still = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=1), timing="velocity")
    still.save(tmp_path / "still.npz")
    assert same(gaitopt.load_plan(tmp_path / "still.npz"), still)


def test_plans_cannot_be_changed(plan: Plan) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.footholds = None  # type: ignore[misc, assignment]
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.record.stability = "none"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        plan.phases[0].cog_start[0] = 1.0


@pytest.mark.parametrize("keep", [0, 1, 100, 5000, -1, -30])
def test_a_file_cut_short_is_refused(short_plan: Plan, tmp_path: Path, keep: int) -> None:
    whole = tmp_path / "plan.npz"
    short_plan.save(whole)
    cut = tmp_path / "cut.npz"
    cut.write_bytes(whole.read_bytes()[:keep])
    with pytest.raises(PlanFileError, match=r"cut\.npz"):
        gaitopt.load_plan(cut)


def test_a_damaged_byte_is_noticed(short_plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / "plan.npz"
    short_plan.save(path)
    data = bytearray(path.read_bytes())
    for place in range(200, len(data), len(data) // 25):
        damaged = bytearray(data)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        try:
            loaded = gaitopt.load_plan(path)
        except PlanFileError:
            continue
        # Bytes of the archive that carry no content may change without harm.
        assert same(loaded, short_plan)


def packed_again(
    plan: Plan, path: Path, changes: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED
) -> Path:
    """The plan's file with other parts, or in another compression."""
    plan.save(path)
    with zipfile.ZipFile(path) as source:
        parts = {name: source.read(name) for name in source.namelist()}
    with zipfile.ZipFile(path, "w", compression) as target:
        for name, data in {**parts, **changes}.items():
            target.writestr(name, data)
    return path


SHAPED = "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},)}}"


@pytest.mark.parametrize(
    "header", ["((((((", SHAPED.format(10**30), SHAPED.format(10**13)],
    ids=["open brackets", "a size beyond integers", "a size beyond memory"],
)  # fmt: skip
def test_arrays_that_cannot_be_read_are_refused(
    short_plan: Plan, tmp_path: Path, header: str
) -> None:
    # NumPy's format: mark, version, length of the header, header.
    start = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1)
    times = start + header.encode() + b"\n"
    path = packed_again(short_plan, tmp_path / "plan.npz", {"times.npy": times})
    with pytest.raises(PlanFileError, match="is no plan file"):
        gaitopt.load_plan(path)


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_damage_in_other_compressions_is_noticed(
    short_plan: Plan, tmp_path: Path, compression: int
) -> None:
    path = packed_again(short_plan, tmp_path / "plan.npz", {}, compression)
    assert same(gaitopt.load_plan(path), short_plan)
    damaged = bytearray(path.read_bytes())
    damaged[200:260] = bytes(60)
    path.write_bytes(damaged)
    with pytest.raises(PlanFileError, match="is no plan file"):
        gaitopt.load_plan(path)


def test_encrypted_parts_are_refused(short_plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / "plan.npz"
    short_plan.save(path)
    data = bytearray(path.read_bytes())
    # The lowest bit of the flags, in the archive's directory and before each part.
    for mark, flags in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
        for match in re.finditer(re.escape(mark), bytes(data)):
            data[match.start() + flags] |= 1
    path.write_bytes(data)
    with pytest.raises(PlanFileError, match="encrypted"):
        gaitopt.load_plan(path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "other"}, "its header is of another kind"),
        ({"version": 99}, "a plan of version 99; this gaitopt reads versions 1 to 3"),
        ({"planner": "teleport"}, "planner 'teleport' is unknown"),
        ({"settings": {"objective": "fast"}}, "objective must be one of"),
        ({"settings": {"colour": "red"}}, "settings of crawl have no field 'colour'"),
        ({"phases": [{"kind": "stance"}]}, "no plan file, or was cut short"),
        ({"phases": None}, "no plan file, or was cut short"),
        ({"column_radius": -1.0}, "radius must be a positive length"),
        ({"column_radius": 10**400}, "radius must be a positive length"),
    ],
)
def test_foreign_headers_are_refused(
    short_plan: Plan, tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    short_plan.save(tmp_path / "plan.npz")
    with pytest.raises(PlanFileError, match=words):
        gaitopt.load_plan(rewritten(tmp_path / "plan.npz", tmp_path / "other.npz", **changes))


def test_a_plan_with_another_urdf_is_refused(short_plan: Plan, tmp_path: Path) -> None:
    short_plan.save(tmp_path / "plan.npz")
    robot = {
        "name": "wang2020",
        "sha256": short_plan.robot.sha256,
        "knees": {},
        "urdf": short_plan.robot.urdf.replace("0.27", "0.28"),
    }
    with pytest.raises(PlanFileError, match="plan again for this robot"):
        gaitopt.load_plan(rewritten(tmp_path / "plan.npz", tmp_path / "b.npz", robot=robot))


def test_entities_inside_a_plan_are_refused(short_plan: Plan, tmp_path: Path) -> None:
    short_plan.save(tmp_path / "plan.npz")
    evil = '<!DOCTYPE robot [<!ENTITY a "b">]>' + short_plan.robot.urdf
    robot = {"name": "x", "sha256": "0", "knees": {}, "urdf": evil}
    with pytest.raises(PlanFileError, match="document type"):
        gaitopt.load_plan(rewritten(tmp_path / "plan.npz", tmp_path / "b.npz", robot=robot))


def test_pickled_arrays_are_never_loaded(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[Any, ...]:
            return (Path.touch, (tmp_path / "exploded",))

    bomb = np.array([Bomb()], dtype=object)
    np.savez(tmp_path / "bomb.npz", header=bomb, footholds=bomb, times=bomb, coefficients=bomb)
    with pytest.raises(PlanFileError):
        gaitopt.load_plan(tmp_path / "bomb.npz")
    assert not (tmp_path / "exploded").exists()


def test_a_file_that_unpacks_to_too_much_is_refused(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short_plan.save(tmp_path / "plan.npz")
    monkeypatch.setattr(storage, "CONTENT_LIMIT", 1000)
    with pytest.raises(PlanFileError, match="would unpack to"):
        gaitopt.load_plan(tmp_path / "plan.npz")


def test_a_zip_of_something_else_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(PlanFileError, match="it has no part header"):
        gaitopt.load_plan(tmp_path / "a.npz")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PlanFileError, match=r"cannot read .*none\.npz"):
        gaitopt.load_plan(tmp_path / "none.npz")


def test_saving_where_nothing_can_be_written(short_plan: Plan, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        short_plan.save(tmp_path / "no" / "plan.npz")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("kind", "jump"),
        ("leg", "XX"),
        ("support", ["XX"]),
        ("start", "a"),
        ("start", None),
        ("margin", "big"),
        ("duration", -5.0),
        ("step", "a"),
        ("cog_start", [1.0, 2.0]),
    ],
)
def test_phases_that_make_no_sense_are_refused(
    short_plan: Plan, tmp_path: Path, field: str, value: Any
) -> None:
    short_plan.save(tmp_path / "plan.npz")
    with np.load(tmp_path / "plan.npz") as stored:
        phases = json.loads(stored["header"].tobytes())["phases"]
    phases[1][field] = value
    with pytest.raises(PlanFileError):
        gaitopt.load_plan(rewritten(tmp_path / "plan.npz", tmp_path / "b.npz", phases=phases))


@pytest.mark.parametrize("spans", [3, "ab", (1.0, 2.0), ((1.0,),), ((1.0, 2.0, 3.0),), ("ab",)])
def test_spans_of_a_limit_are_pairs_of_times(spans: Any) -> None:
    with pytest.raises(InputError, match="of a limit"):
        Limit("joint velocity", "LF_KFE", 1.0, spans)


def test_phases_hold_no_lists_that_could_change(short_plan: Plan) -> None:
    spans, phase = [[0.0, 1.0]], short_plan.phases[0]
    limit = Limit("speed", "", 1.0, spans)  # type: ignore[arg-type]
    limits, legs = [limit], list(phase.support)
    other = dataclasses.replace(phase, support=legs, limited_by=limits)  # type: ignore[arg-type]
    spans[0][0] = 9.0
    limits.clear()
    legs.clear()
    assert other.support == phase.support
    assert other.limited_by[0].spans == ((0.0, 1.0),)


def test_a_path_to_the_stars_is_refused(short_plan: Plan) -> None:
    path = short_plan.path
    with pytest.raises(InputError, match=r"leads .* away"):
        gaitopt.MotionPath(path.times, path.coefficients * 1e300)


def test_a_link_stays_a_link(short_plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.npz").symlink_to(tmp_path / "real" / "plan.npz")
    short_plan.save(tmp_path / "link.npz")
    assert (tmp_path / "link.npz").is_symlink() and (tmp_path / "real" / "plan.npz").is_file()
