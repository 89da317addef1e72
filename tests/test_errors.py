"""The family of errors: one root, each also the built-in kind that a caller expects."""

from __future__ import annotations

import inspect
import pickle

import pytest

from gaitopt import errors
from gaitopt.errors import GaitoptError, InfeasibleStepError

FAMILY = [c for _, c in inspect.getmembers(errors, inspect.isclass) if issubclass(c, GaitoptError)]
BUILT_IN = {
    "InputError": ValueError,
    "RobotError": ValueError,
    "FootholdsError": ValueError,
    "PlanFileError": ValueError,
    "SolverError": RuntimeError,
    "MissingPackageError": ImportError,
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
    assert names == {"GaitoptError", "InfeasibleSpeedError", "InfeasibleStepError", *BUILT_IN}


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
