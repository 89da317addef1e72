"""The family of errors: one root, one file, each also the built-in kind that a caller expects."""

from __future__ import annotations

import ast
import builtins
import inspect
import pickle
import re
from pathlib import Path

import pytest

import gaitopt
from gaitopt import errors
from gaitopt.errors import GaitoptError, InfeasibleStepError, InputError
from gaitopt.studies.race import race

PACKAGE = Path(gaitopt.__file__).parent
BUILT_IN_ERRORS = {
    name for name, value in vars(builtins).items()
    if isinstance(value, type) and issubclass(value, BaseException)
}  # fmt: skip

FAMILY = [c for _, c in inspect.getmembers(errors, inspect.isclass) if issubclass(c, GaitoptError)]
BUILT_IN = {
    "InputError": ValueError,
    "RobotError": ValueError,
    "FootholdsError": ValueError,
    "GroundError": ValueError,
    "PlanFileError": ValueError,
    "SolverError": RuntimeError,
    "StudyError": RuntimeError,
    "MissingPackageError": ImportError,
    "UnknownNameError": KeyError,
}
WITH_FIELDS = {
    "InfeasibleSpeedError": {"message", "limit", "needed", "time"},
    "InfeasibleStateError": {"message", "limit", "value", "allowed", "unit"},
    "InfeasibleStepError": {"message", "step", "leg"},
    "SingularLegError": {"message", "leg"},
    "TerrainError": {"message", "step", "leg", "refused", "search"},
    "RouteError": {"message", "steps", "plan", "report"},
    "UnsolvedSplineError": {"message", "spline"},
    "CertificateError": {"message", "certificate"},
    "StrideFault": {"message", "leg", "step", "cause"},
}


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.Module]:
    """The syntax of all modules; as long as these tests run, for it is large."""
    return {
        str(path.relative_to(PACKAGE)): ast.parse(path.read_text("utf-8"))
        for path in sorted(PACKAGE.rglob("*.py"))
    }


def step_error() -> InfeasibleStepError:
    return InfeasibleStepError(
        "step 3 (RF): margin 0.05 m does not fit",
        step=3,
        leg="RF",
        conflicts=("margin LF-RH", "reach RF"),
        margin=0.05,
        largest_margin=0.031,
        reach_fraction=1.0,
    )


def test_family_is_complete() -> None:
    names = {c.__name__ for c in FAMILY}
    assert names == {"GaitoptError", *WITH_FIELDS, *BUILT_IN}


def test_every_error_class_stands_in_errors_py(trees: dict[str, ast.Module]) -> None:
    """Also classes that derive from a built-in error, or from an error by way of another class."""
    known = BUILT_IN_ERRORS | {c.__name__ for c in FAMILY}
    classes = [
        (file, node)
        for file, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    ]
    found: set[tuple[str, str]] = set()
    for _ in range(len(classes)):
        new = {
            (file, node.name)
            for file, node in classes
            if any(ast.unparse(base).split(".")[-1] in known for base in node.bases)
        } - found
        if not new:
            break
        found |= new
        known |= {name for _, name in new}
    assert {name for file, name in found if file == "errors.py"} > {c.__name__ for c in FAMILY}
    assert [(file, name) for file, name in sorted(found) if file != "errors.py"] == []


# What a protocol of Python asks for: getattr() of a module, and the end of a program.
ALLOWED_BUILT_INS = {("__init__.py", "AttributeError"), ("*", "SystemExit")}


def test_what_is_raised_on_purpose_is_of_the_family(trees: dict[str, ast.Module]) -> None:
    wrong = []
    for file, tree in trees.items():
        for node in ast.walk(tree):
            if not isinstance(node, ast.Raise) or node.exc is None:
                continue
            kind = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            name = ast.unparse(kind)
            allowed = {(file, name), ("*", name)} & ALLOWED_BUILT_INS
            if name in BUILT_IN_ERRORS and not allowed:
                wrong.append(f"{file}:{node.lineno} raises {name}")
    assert wrong == []


def test_nothing_is_asserted_of_what_a_user_gives(trees: dict[str, ast.Module]) -> None:
    """``assert`` raises no error of the family; it may only tell mypy a type."""
    tells_a_type = re.compile(r"isinstance\(.*\)|.* is not None")
    wrong = [
        f"{file}:{node.lineno}"
        for file, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Assert) and not tells_a_type.fullmatch(ast.unparse(node.test))
    ]
    assert wrong == []


@pytest.mark.parametrize("name", WITH_FIELDS)
def test_an_error_with_fields_reads_as_its_message_and_survives_pickling(name: str) -> None:
    kind = getattr(errors, name)
    error = kind(**{field: f"the {field}" for field in WITH_FIELDS[name]})
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind and str(again) == str(error) == "the message"
    assert vars(again) == vars(error)
    assert isinstance(error, GaitoptError) and {error}


def test_infeasible_speed_reads_as_its_message_and_survives_pickling() -> None:
    error = errors.InfeasibleSpeedError(
        "0.3 m/s is too much", limit="velocity LF_KFE", needed=2.0, time=1.5, fastest=0.4,
        velocity=(0.12, 0.0), yaw_rate=0.0,
    )  # fmt: skip
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "0.3 m/s is too much"
    assert again == error and again.velocity == (0.12, 0.0) and again.cycle_time is None


@pytest.mark.parametrize(("name", "kind"), BUILT_IN.items())
def test_error_is_also_its_built_in_kind(name: str, kind: type[Exception]) -> None:
    error = getattr(errors, name)
    assert issubclass(error, GaitoptError) and issubclass(error, kind)
    assert not issubclass(error, OSError)  # written_whole turns those into its own words


@pytest.mark.parametrize("name", BUILT_IN)
def test_message_survives_pickling(name: str) -> None:
    error = pickle.loads(pickle.dumps(getattr(errors, name)("leg LF: 3 m")))
    assert type(error).__name__ == name and str(error) == "leg LF: 3 m"


def test_infeasible_step_reads_as_its_message() -> None:
    assert str(step_error()) == "step 3 (RF): margin 0.05 m does not fit"
    with pytest.raises(GaitoptError, match=r"^step 3 \(RF\): margin 0\.05 m does not fit$"):
        raise step_error()


def test_infeasible_step_carries_what_is_known_and_nothing_else() -> None:
    error = step_error()
    assert (error.step, error.leg, error.margin, error.largest_margin) == (3, "RF", 0.05, 0.031)
    assert error.conflicts == ("margin LF-RH", "reach RF")
    assert error.needed_reach_fraction is None


def test_infeasible_step_survives_pickling_with_its_numbers() -> None:
    assert pickle.loads(pickle.dumps(step_error())) == step_error()


@pytest.mark.skipif(not hasattr(Exception, "add_note"), reason="notes are from Python 3.11 on")
def test_infeasible_step_survives_pickling_with_a_note_on_it() -> None:
    error = step_error()
    error.add_note("seen on seed 7")
    copy = pickle.loads(pickle.dumps(error))
    assert copy == step_error()


def test_infeasible_step_can_be_kept_in_a_set() -> None:
    error = step_error()
    assert error in {error}


@pytest.mark.parametrize("kind", FAMILY, ids=lambda c: c.__name__)
def test_every_error_says_what_it_is_for(kind: type[Exception]) -> None:
    assert kind.__doc__ and len(kind.__doc__) > 20


PLAN_TAKERS = (
    "com_margin contact_forces export_csv export_ros replay retimed save_figures "
    "save_gait_figures show simulate verify view"
)


@pytest.mark.parametrize("name", PLAN_TAKERS.split())
def test_a_file_name_in_place_of_a_plan_is_named_with_the_way_out(
    name: str, tmp_path: Path
) -> None:
    more = [tmp_path / "out"] if name.startswith(("export", "replay", "save")) else []
    with pytest.raises(InputError, match=r"Plan, .*got a?.*str.*gaitopt\.load_plan"):
        getattr(gaitopt, name)("plan.npz", *more)
    assert not any(tmp_path.iterdir())


def test_a_name_in_place_of_a_robot_is_named_with_the_way_out() -> None:
    ground = gaitopt.s_columns(columns=2)
    calls = [
        lambda: gaitopt.s_columns(robot="go2"),  # type: ignore[arg-type]
        lambda: gaitopt.compare("go2", ground),  # type: ignore[arg-type]
        lambda: race("go2", ground),  # type: ignore[arg-type]
        lambda: gaitopt.feasible_region("go2", ground.array[:, 0]),  # type: ignore[arg-type]
        lambda: gaitopt.plan_crawl("go2", ground),  # type: ignore[arg-type]
    ]
    for call in calls:
        with pytest.raises(InputError, match=r"Quadruped.*load_robot"):
            call()


def test_something_else_in_place_of_footholds_is_named(wang: gaitopt.Quadruped) -> None:
    for wrong in ("ground.csv", 3, [gaitopt.s_columns(columns=2)]):
        with pytest.raises(InputError, match=r"terrains must be Footholds, or pairs"):
            gaitopt.compare(wang, wrong)  # type: ignore[arg-type]


def test_a_warning_names_the_line_of_whoever_called(trees: dict[str, ast.Module]) -> None:
    """Not a line within gaitopt; so notebooks show the user's own cell."""
    with pytest.warns(errors.RobotWarning, match="placeholders") as told:
        gaitopt.load_robot("solo12")
    assert {Path(one.filename) for one in told} == {Path(__file__)}
    for name, tree in trees.items():
        named = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and n.attr == "warn"]
        direct = [n for n in named if ast.unparse(n.value) == "warnings"]
        assert not direct or name == "errors.py", f"{name}: use gaitopt.errors.warn"
