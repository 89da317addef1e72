"""No circle of imports between modules, those inside functions and for type checking counted.

The layers are held by import-linter (pyproject.toml).
"""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "gaitopt"


def module_name(path: Path, package: Path = PACKAGE) -> str:
    """The dotted name of a source file."""
    parts = path.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(package: Path = PACKAGE) -> dict[str, set[str]]:
    """For every module of a package, the modules of it that it imports, wherever it does so.

    ``from package.a import b`` counts as an import of ``package.a.b`` where that is a module,
    and of ``package.a`` otherwise.
    """
    files = {module_name(path, package): path for path in sorted(package.rglob("*.py"))}
    found: dict[str, set[str]] = {}
    for name, path in files.items():
        targets: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                targets |= {x if x in files else node.module for x in inner}
        found[name] = (targets & files.keys()) - {name}
    return found


def circles(imports: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import one another, directly or in a circle."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    groups: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(imports[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            at = stack.index(name)
            if len(stack) - at > 1:
                groups.append(sorted(stack[at:]))
            del stack[at:]

    for name in imports:
        if name not in index:
            visit(name)
    return groups


def test_no_circle_of_imports() -> None:
    assert circles(imports_of()) == []


def test_a_circle_is_found_where_there_is_one(tmp_path: Path) -> None:
    package = tmp_path / "house"
    (package / "floor").mkdir(parents=True)
    sources = {
        "__init__.py": "",
        "floor/__init__.py": "",
        "floor/a.py": "from house.floor import b",
        "floor/b.py": "def late():\n    from house.c import thing",
        "c.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import house.floor.a",
        "d.py": "from house.c import thing",
    }
    for name, text in sources.items():
        (package / name).write_text(text, "utf-8")
    assert circles(imports_of(package)) == [["house.c", "house.floor.a", "house.floor.b"]]


def test_no_folder_is_fuller_than_a_reader_can_hold() -> None:
    rooms = PACKAGE, PACKAGE.parent / "benchmarks"
    folders = [f for room in rooms for f in (room, *room.rglob("*")) if f.is_dir()]
    full = {f.name: len(list(f.glob("*.py"))) for f in folders}
    assert {name: count for name, count in full.items() if count > 22} == {}
