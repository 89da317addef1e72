"""What ``import gaitopt`` gives, and how quickly."""

from __future__ import annotations

import ast
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import gaitopt

HEAVY = ("pinocchio", "casadi", "matplotlib", "meshcat", "scipy", "yourdfpy", "proxsuite", "mujoco")
NAMES = sorted(n for n in gaitopt.__all__ if not n.startswith("_"))
SOURCE = Path(gaitopt.__file__)


def in_a_fresh_interpreter(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=600
    )
    return done.stdout


def test_import_loads_nothing_heavy() -> None:
    found = json.loads(
        in_a_fresh_interpreter(
            "import json, sys; import gaitopt; print(json.dumps({'modules': sorted(sys.modules)}))"
        )
    )
    assert [m for m in HEAVY if m in found["modules"]] == []


def test_terrain_and_margins_need_no_robot_library() -> None:
    """Pure maths stays light: no Pinocchio to scatter columns."""
    loaded = in_a_fresh_interpreter(
        "import sys, gaitopt; gaitopt.s_columns(); "
        "gaitopt.static_stability_margin([[0, 0], [1, 0], [0, 1]], [0.2, 0.2]); "
        "print([m for m in ('pinocchio', 'casadi', 'matplotlib', 'meshcat') if m in sys.modules])"
    )
    assert loaded.strip() == "[]"


def test_a_first_plan_loads_only_what_it_uses() -> None:
    """A new process has its first plan by velocity as soon as that is loaded (see benchmarks)."""
    loaded = in_a_fresh_interpreter(
        "import sys, gaitopt as g; robot = g.load_robot('wang2020'); "
        "g.plan_crawl(robot, g.s_columns(0), timing='velocity'); "
        "print([m for m in sys.modules if m in ('scipy', 'numpy.ma', 'importlib.metadata')"
        " or m.startswith(('gaitopt.entering.', 'gaitopt.planners.time_optimal.'))])"
    )
    assert loaded.strip() == "[]"


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_resolves(name: str) -> None:
    assert getattr(gaitopt, name) is not None
    assert getattr(gaitopt, name) is getattr(gaitopt, name)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_says_what_it_is(name: str) -> None:
    value = getattr(gaitopt, name)
    if inspect.isclass(value) or inspect.isroutine(value):
        doc = inspect.getdoc(value)
        assert doc and doc.split("\n")[0].rstrip().endswith((".", ":")) and len(doc) > 20
        assert not doc.startswith(f"{name}(")  # what a dataclass writes when nobody did


@pytest.mark.parametrize("name", NAMES)
def test_public_methods_say_what_they_do(name: str) -> None:
    value = getattr(gaitopt, name)
    if not inspect.isclass(value):
        return
    for attribute, member in vars(value).items():
        public = not attribute.startswith("_")
        if public and (inspect.isfunction(member) or isinstance(member, (property, classmethod))):
            assert inspect.getdoc(getattr(value, attribute)) or inspect.getdoc(member), attribute


def test_the_page_of_the_api_tells_of_all_that_is_public() -> None:
    page = (SOURCE.parent.parent / "docs" / "api.md").read_text("utf-8")
    told = re.findall(r"^\.\. auto\w+:: ([\w.]+)", page, re.M)
    assert {name.split(".")[-1] for name in told} >= set(NAMES)


def test_what_a_type_checker_sees_is_what_python_gives() -> None:
    """The imports under TYPE_CHECKING name the same homes as the table used at run time."""
    tree = ast.parse(SOURCE.read_text("utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    seen = {
        alias.asname: f"{node.module}.{alias.name}"
        for node in ast.walk(block)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen == {n: f"gaitopt.{gaitopt._EXPORTS[n]}.{n}" for n in gaitopt._EXPORTS}


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError) as caught:
        gaitopt.plan_moonwalk  # noqa: B018
    assert str(caught.value) == "module 'gaitopt' has no attribute 'plan_moonwalk'"
    assert not hasattr(gaitopt, "np")


def test_star_import_gives_the_public_names() -> None:
    wanted = "LEGS Footholds s_columns load_robot InputError"
    code = f"from gaitopt import *; print(all(n in globals() for n in {wanted.split()!r}))"
    assert in_a_fresh_interpreter(code).strip() == "True"


def test_version_is_the_installed_one() -> None:
    from importlib.metadata import version

    assert gaitopt.__version__ == version("gaitopt")


def rooms() -> list[ModuleType]:
    """Every module of the rooms that walk, terrain, order and stability live in."""
    from importlib import import_module

    files = [
        f for room in ("robots", "terrain", "gait", "swing", "stability")
        for f in sorted((SOURCE.parent / room).glob("*.py"))
    ]  # fmt: skip
    files += [SOURCE.parent / f"{n}.py" for n in ("conventions", "errors", "files")]
    return [
        import_module(".".join(("gaitopt", *f.relative_to(SOURCE.parent).with_suffix("").parts)))
        for f in files
        if f.name != "__init__.py"
    ]


@pytest.mark.parametrize("module", rooms(), ids=lambda m: m.__name__)
def test_every_function_and_class_of_a_room_has_its_docstring(module: ModuleType) -> None:
    assert module.__doc__
    for name, value in vars(module).items():
        own = getattr(value, "__module__", None) == module.__name__
        if (
            own
            and not name.startswith("_")
            and (inspect.isclass(value) or inspect.isroutine(value))
        ):
            assert value.__doc__, f"{module.__name__}.{name}"
