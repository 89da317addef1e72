"""The documents: the site builds without a warning, what they show runs, what they name exists."""

from __future__ import annotations

import ast
import contextlib
import importlib
import importlib.util
import io
import os
import re
import runpy
import shlex
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from in_browser import HAS_BROWSER

import gaitopt
from gaitopt.cli.app import main
from gaitopt.viewing.replay.video.chromium import chromium

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


class Fence(NamedTuple):
    """A fenced block of a Markdown file."""

    language: str
    text: str
    line: int
    joined: bool  # nothing but blank lines between it and the block before


def fences(path: Path) -> list[Fence]:
    found: list[Fence] = []
    inside, language, start, between = None, "", 0, ""
    for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
        if inside is None and (opening := re.fullmatch(r"```(\S+).*", line)):
            inside, language, start = [], opening[1], number
        elif inside is not None and line == "```":
            found.append(Fence(language, "\n".join(inside), start, not between.strip()))
            inside, between = None, ""
        elif inside is not None:
            inside.append(line)
        else:
            between += line
    assert inside is None, f"{path.name}, line {start}: the block has no end"
    return found


def run_python(fence: Fence, name: str, space: dict[str, Any]) -> str:
    """What a block prints; a gaitopt error ends it and is its last line."""
    code = compile("\n" * fence.line + fence.text, name, "exec")
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        try:
            exec(code, space)
        except gaitopt.GaitoptError as error:
            print(f"{type(error).__name__}: {error}")
    return out.getvalue()


SLOW = (
    "$ gaitopt walk --out out",
    "$ gaitopt walk --robot anymal --out anymal",
    "$ gaitopt walk --footholds mine.csv --out mine",
    "$ gaitopt figures plan.npz figures",
    "$ gaitopt stride --out out",
    "$ gaitopt stride --robot wang2020 --shape round --height 0.06 --out log",
    "$ gaitopt terrain step.png --resolution 0.02 --heights 0,0.1 --robot go2 --out out",
    "$ gaitopt terrain rubble --robot go2 --seed 1 --out rubble",
)
"""Commands of the pages that the tests of the command line run in much the same way."""


def run_command(line: str) -> str:
    """What ``$ gaitopt ...`` prints, or its error; it runs in this process, which has all loaded.

    Commands that begin with an empty process are tested in ``tests/cli/test_app.py``.
    """
    out, errors = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(sys, "argv", ["gaitopt", *shlex.split(line[10:], comments=True)])
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(errors),
            pytest.raises(SystemExit) as exit_,
        ):
            main()
    assert exit_.value.code in (0, 2), f"{line}: {errors.getvalue()}"
    return (errors if exit_.value.code else out).getvalue()


def run_console(fence: Fence) -> str:
    """What the block's ``$ gaitopt ...`` lines print; other commands are left alone."""
    lines = fence.text.splitlines()
    return "".join(run_command(x) for x in lines if x.startswith("$ gaitopt ") and x not in SLOW)


def words(text: str) -> str:
    return " ".join(text.split())


def run_document(path: Path) -> int:
    """Run a document's blocks in order in this folder; a ``text`` block says what one prints.

    ``...`` in a ``text`` block stands for anything. Lines may be broken anywhere in it.
    """
    space: dict[str, Any] = {"__name__": "__main__"}
    blocks = fences(path)
    count = 0
    for fence, after in zip(blocks, [*blocks[1:], None], strict=True):
        if fence.language not in ("python", "console"):
            continue
        count += 1
        is_python = fence.language == "python"
        printed = run_python(fence, path.name, space) if is_python else run_console(fence)
        where = f"{path.name}, line {fence.line}"
        if after is not None and after.language == "text" and after.joined:
            told = re.escape(words(after.text)).replace(r"\.\.\.", ".*")
            assert re.fullmatch(told, words(printed)), f"{where} prints:\n{printed}"
        else:
            assert "Error: " not in printed, f"{where}:\n{printed}"
    return count


@pytest.mark.usefixtures("no_pixels")
@pytest.mark.parametrize("name", ["README.md", "docs/index.md", "docs/tutorial.md",
                                  "docs/errors.md", "docs/plan_file.md", "docs/robots.md",
                                  "docs/theory.md", "docs/reproduction.md", "docs/gaits.md",
                                  "docs/trust.md", "docs/striding.md",
                                  "docs/time_optimal.md", "docs/forces.md",
                                  "docs/terrain.md", "docs/from_state.md",
                                  "docs/to_robots.md", "docs/replay.md",
                                  "docs/start.md"])  # fmt: skip
def test_what_documents_show_runs_and_prints_what_they_say(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = ROOT / name
    monkeypatch.chdir(tmp_path)
    assert run_document(path) > 0 or name == "README.md"


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="needs pip install 'gaitopt[docs]'")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html",
               "-d", str(tmp_path / "doctrees"), str(DOCS), str(tmp_path / "html")]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200,
                          env={**os.environ, "GAITOPT_VERSIONS": "latest,v0.1.0"})  # fmt: skip
    assert done.returncode == 0, done.stderr
    check_links_to_versions(tmp_path / "html")
    for page in DOCS.glob("*.md"):
        built = tmp_path / "html" / f"{page.stem}.html"
        loaded = r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//'
        assert not re.search(loaded, built.read_text("utf-8")), f"{page.name} loads from elsewhere"
    if HAS_BROWSER:
        search_offline(tmp_path / "html")


def check_links_to_versions(site: Path) -> None:
    """Every page leads to both versions, whose folders lie beside that of the site."""
    pages = [*site.glob("*.html"), *site.glob("notebooks/*.html")]
    assert any(page.parent != site for page in pages)
    for page in pages:
        links = re.findall(
            r'href="([./]+(?:latest|v0\.1\.0)/index\.html)"', page.read_text("utf-8")
        )
        found = {(page.parent / link).resolve() for link in links}
        assert found == {site.parent / name / "index.html" for name in ("latest", "v0.1.0")}, page


def search_offline(site: Path) -> None:
    """The search of the site works from files, without a server or a network."""
    found = "document.querySelectorAll('#search-results a')"
    with chromium() as browser:
        browser.open(f"{(site / 'search.html').as_uri()}?q=certificate", (800, 600),
                     ready=f"{found}.length > 5")  # fmt: skip
        pages = browser.run(f"[...{found}].map((a) => a.getAttribute('href'))")
    assert "api.html#gaitopt.Certificate" in pages


def test_versions_of_the_site_are_those_of_the_tags() -> None:
    spec = importlib.util.spec_from_file_location("make_site", DOCS / "make_site.py")
    assert spec is not None and spec.loader is not None
    site = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(site)
    found = site.in_order(["v0.9.0", "v0.10.0", "v1", "draft", "v0.10.0-rc1", "v0.10.1"])
    assert found == ["v1", "v0.10.1", "v0.10.0", "v0.9.0"]


def test_every_link_between_files_leads_somewhere() -> None:
    pages = [*DOCS.glob("*.md"), *ROOT.glob("*.md"), *ROOT.glob("notebooks/*.ipynb")]
    for page in pages:
        for target in re.findall(r"\]\(([^)\s#]+)[^)]*\)", page.read_text("utf-8")):
            if re.match(r"[a-z]+:", target):
                continue
            # What is included into the site is read from docs/, too.
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def exists(dotted: str) -> bool:
    """Whether ``gaitopt.<dotted>`` is a module, or something in one."""
    parts = dotted.split(".")
    for cut in range(len(parts), -1, -1):
        try:
            found: Any = importlib.import_module(".".join(["gaitopt", *parts[:cut]]))
        except ModuleNotFoundError:
            continue
        for part in parts[cut:]:
            if part in getattr(found, "__dataclass_fields__", {}):
                return True
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


PAGES = [*sorted(DOCS.glob("*.md")), *sorted(ROOT.glob("*.md")), ROOT / "benchmarks" / "README.md"]
ROOMS = sorted(p.stem for p in (ROOT / "gaitopt").iterdir() if p.suffix == ".py" or p.is_dir())
NAMES_BELOW_GAITOPT = ("reproduction.md", "theory.md")
"""Pages that leave out ``gaitopt.`` in front of names."""
FILE_ENDINGS = r"\.(py|css|html|js|npz|csv|yaml|md|urdf|toml)$"


def page_name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_every_dotted_name_on_a_page_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    named = {n.rstrip(".") for n in re.findall(r"\bgaitopt\.([a-zA-Z_][\w.]*)", text)}
    if page.name in NAMES_BELOW_GAITOPT:
        quoted = re.findall(r"`([a-z_0-9]+(?:\.\w+)+)`", text)
        named |= {n for n in quoted if n.split(".")[0] in ROOMS}
        assert len(named) > 5
    missing = sorted(n for n in named if not re.search(FILE_ENDINGS, n) and not exists(n))
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_every_path_on_a_page_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    roots = "gaitopt|tests|docs|benchmarks|urdf|notebooks"
    paths = re.findall(rf"(?<![\w./-])((?:{roots})/[\w./-]*\w)", text)
    # Tables of contents name notebooks without their ending.
    known = {ROOT / path for path in BUILT}
    known |= {path.with_suffix("") for path in ROOT.glob("notebooks/*.ipynb")}
    missing = sorted(p for p in set(paths) if not (ROOT / p).exists() and ROOT / p not in known)
    assert not missing


BUILT = {"docs/_build", "docs/_build/html", "docs/_build/html/index.html", "gaitopt/urdf"}
"""Paths that exist only after a build."""


@pytest.mark.parametrize("folder", ["gaitopt", "tests", "benchmarks"])
def test_every_dotted_name_in_docstrings_and_comments_exists(folder: str) -> None:
    """Sphinx resolves no roles here, so a renamed module would go unnoticed."""
    missing = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        if path == Path(__file__):
            continue
        text = path.read_text("utf-8")
        named = set(re.findall(r":\w+:`~?gaitopt\.([\w.]+)`", text))
        if bad := sorted(n for n in named if not exists(n)):
            missing[page_name(path)] = bad
    assert not missing


def names_of_tests(path: Path) -> set[str]:
    tree = ast.parse(path.read_text("utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_every_test_that_a_page_names_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    named = set(re.findall(r"`(tests/[\w/]+\.py)`?::`?(test_\w+)`", text))
    there = {file: names_of_tests(ROOT / file) for file, _ in named if (ROOT / file).is_file()}
    missing = [f"{file}::{test}" for file, test in named if test not in there.get(file, ())]
    assert not missing
    assert len(named) > 5 or page.name not in NAMES_BELOW_GAITOPT


SOURCES = sorted(
    path
    for folder in ("gaitopt", "tests", "benchmarks", "docs", "urdf", "notebooks")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".md", ".urdf", ".ipynb"} and "_build" not in path.parts
)
KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:19|20)\d\d|XiLing)\]")


def test_every_source_that_is_cited_has_its_place_on_the_page_of_papers() -> None:
    papers = DOCS / "papers.md"
    listed = set(re.findall(r"^(?:### |\| )\[(\w+)\]", papers.read_text("utf-8"), re.MULTILINE))
    cited = {
        key
        for path in [*SOURCES, *ROOT.glob("*.md")]
        if path != papers
        for key in KEY.findall(path.read_text("utf-8"))
    }
    assert len(listed) > 10
    assert cited - listed == set(), "cited, and not on docs/papers.md"
    assert listed - cited == set(), "on docs/papers.md, and cited nowhere"


def test_no_page_or_docstring_names_a_file_that_readers_do_not_have() -> None:
    seed = re.compile(r"\b\d{3}_[0-9a-f]{12,}|errata" + r"\.md|shared/(?:seeds|design)")
    found = [page_name(p) for p in SOURCES if seed.search(p.read_text("utf-8"))]
    assert not found


def test_every_equation_table_and_figure_of_the_paper_has_its_row() -> None:
    text = (DOCS / "reproduction.md").read_text("utf-8")
    rows = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    for number in range(1, 17):
        assert f"({number})" in rows, f"equation {number}"
    for number in range(1, 16):
        assert f"Fig. {number}" in rows, f"figure {number}"
    for table in ("Table I", "Table II"):
        assert table in rows


@pytest.mark.parametrize(("paper", "figures", "equations"),
                         [("Wang2024", 14, 20), ("Shao2011", 8, 11)])  # fmt: skip
def test_the_other_papers_have_rows_for_all_figures_and_equations(
    paper: str, figures: int, equations: int
) -> None:
    text = (DOCS / "reproduction.md").read_text("utf-8")
    section = re.split(r"^## ", text.split(f"## [{paper}]")[1], flags=re.M)[0]
    heads = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")]
    shown = {int(n) for head in heads for group in re.findall(r"Figs?\. ([\d, ]+)", head)
             for n in re.findall(r"\d+", group)}  # fmt: skip
    assert shown >= set(range(1, figures + 1))
    numbered: set[int] = set()
    for head in heads:
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", head):
            numbered |= set(range(int(first), int(last or first) + 1))
    assert numbered >= set(range(1, equations + 1))


def test_the_badges_are_true(tmp_path: Path) -> None:
    """Those that are committed are those that pyproject.toml makes, and mypy is strict."""
    script = runpy.run_path(str(DOCS / "make_images.py"))
    script["badges"](tmp_path / "badges.svg")
    made = (tmp_path / "badges.svg").read_text("utf-8")
    assert made == (DOCS / "images" / "badges.svg").read_text("utf-8")
    assert "images/badges.svg" in (ROOT / "README.md").read_text("utf-8")
    settings = (ROOT / "pyproject.toml").read_text("utf-8").split("[tool.mypy]")[1]
    assert "strict = true" in settings.split("[tool.")[0]
    assert f">{gaitopt.__version__}<" in made


def test_every_public_name_has_its_place_in_the_api() -> None:
    text = (DOCS / "api.md").read_text("utf-8")
    missing = [
        name
        for name in sorted(set(gaitopt.__all__) - {"__version__"})
        if not re.search(rf"auto\w+:: (gaitopt\.[\w.]+\.)?{name}\b", text)
    ]
    assert not missing


def test_every_topic_of_the_api_has_a_line_for_newcomers() -> None:
    text = (DOCS / "api.md").read_text("utf-8")
    topics = re.split(r"^## ", text, flags=re.M)[1:]
    assert len(topics) > 10
    assert [t.splitlines()[0] for t in topics if not re.match(r".+\n\nNew here\? ", t)] == []


def files_on_the_plan() -> set[str]:
    """Paths below gaitopt/ of all files in the tree of packages on the page of the architecture."""
    text = (DOCS / "architecture.md").read_text("utf-8")
    tree = re.search(r"```text\ngaitopt/\n(.*?)```", text, flags=re.DOTALL)
    assert tree is not None
    folder, found = "", set()
    for line in tree[1].splitlines():
        if opening := re.match(r"  ([\w/]+/)(?= )", line):
            folder = opening[1]
            assert (ROOT / "gaitopt" / folder).is_dir(), folder
        found |= {folder + name for name in re.findall(r"\b\w+\.(?:py|css|html|js)\b", line)}
    return found


def test_the_plan_of_the_house_shows_every_module_and_no_other() -> None:
    package = ROOT / "gaitopt"
    there = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*")
        if path.suffix in {".py", ".css", ".html", ".js"} and not path.name.startswith("__")
    }
    shown = files_on_the_plan()
    assert shown - there == set(), "on the plan, and not there"
    assert there - shown == set(), "there, and not on the plan"


def test_the_floors_of_the_house_are_those_of_the_contract() -> None:
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    contract = re.search(r'containers = \["gaitopt"\]\nlayers = \[\n(.*?)\]', project, re.DOTALL)
    assert contract is not None
    floors = "\n".join(re.findall(r'"(.+)"', contract[1]))
    assert f"```text\n{floors}\n```" in (DOCS / "architecture.md").read_text("utf-8")


def test_every_dependency_is_explained() -> None:
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    section = project.split("[project.optional-dependencies]")
    lists = section[0].split("dependencies = [")[1] + section[1].split("[project.scripts]")[0]
    text = (DOCS / "dependencies.md").read_text("utf-8")
    for name in re.findall(r'"([A-Za-z][\w-]*)(?:>=|")', lists):
        assert f"`{name}`" in text, name


def test_images_are_small() -> None:
    for image in (DOCS / "images").iterdir():
        # An animation has thirty pictures.
        most = 250_000 if image.suffix == ".webp" else 150_000
        assert image.stat().st_size < most, image.name


def test_the_draft_of_the_paper_cites_what_its_bibliography_has() -> None:
    paper = ROOT / "paper"
    cited = set(re.findall(r"@(\w+)", (paper / "paper.md").read_text("utf-8")))
    listed = set(re.findall(r"@\w+\{(\w+)", (paper / "paper.bib").read_text("utf-8")))
    assert cited == listed
