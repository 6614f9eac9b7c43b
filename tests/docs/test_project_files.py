"""What a public project says of itself is true: versions, commands, paths, links."""

import ast
import os
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from excite_cli import __version__
from tests.cli.program import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PINNED = ROOT / "requirements" / "ci.txt"
# Packages that messages tell to install and that are none of the program's own needs.
OTHERS = {"robot_descriptions", "ur_rtde", "pylibfranka"}
# Modules that a workflow installs itself or that are of the tools of development.
TOOLS = {"pip", "build", "cibuildwheel", "pytest", "venv"}


# Names of packages at conda-forge, where they are others than at PyPI.
RENAMED = {
    "pin": "pinocchio-python",
    "coal": "coal-python",
    "matplotlib": "matplotlib-base",
    "mujoco": "mujoco-python",
}


def loaded(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


RECIPE = loaded(ROOT / "recipe" / "recipe.yaml")


def commands(path: Path) -> list[str]:
    """Everything that a workflow runs."""
    jobs = loaded(path)["jobs"].values()
    return [step["run"] for job in jobs for step in job["steps"] if "run" in step]


def missing(text: str) -> list[str]:
    """Targets, modules, scripts and tests that a text names and that there are not."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([\w-]+):", makefile, re.MULTILINE))
    wrong = [
        f"make {name}" for name in re.findall(r"\bmake ([a-z][\w-]*)", text) if name not in targets
    ]
    for name in re.findall(r"python -m ([\w.]+)", text):
        path = ROOT / Path(*name.split("."))
        if name not in TOOLS and not path.with_suffix(".py").exists():
            wrong.append(f"python -m {name}")
    for name in re.findall(r"(?<![\w/])(\.ci/\w+)", text):
        if not os.access(ROOT / name, os.X_OK):
            wrong.append(name)
    for path, test in re.findall(r"(tests/[\w/]+\.py)(?:::(\w+))?", text):
        if not (ROOT / path).exists() or f"def {test}" not in (ROOT / path).read_text("utf-8"):
            wrong.append(f"{path}::{test}")
    return wrong


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_run_what_there_is(path: Path) -> None:
    ran = commands(path)
    assert ran
    assert missing("\n".join(ran)) == []


def test_contributing_names_what_there_is() -> None:
    assert missing(CONTRIBUTING) == []
    named = re.findall(r"`((?:excite_cli|tests|docs)/[\w/.]+)`", CONTRIBUTING)
    named += re.findall(r"\]\((?!https:)([^)]+)\)", CONTRIBUTING)
    assert len(named) > 15
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_contributing_names_what_members_must_have() -> None:
    """Names in the recipes are those of the abstract classes."""
    for heading, path in {
        "effect": "effects/base.py",
        "constraint": "constraints/base.py",
        "criterion": "criteria/base.py",
        "reader": "measurement/reader.py",
        "motion format": "motion_formats/base.py",
        "check": "checks/base.py",
    }.items():
        form = rf"- \*\*An? {heading}\*\* \(`{path}`\): (.*?\.)(?: |\n)"
        (recipe,) = re.findall(form, CONTRIBUTING)
        text = (ROOT / "excite_cli" / path).read_text(encoding="utf-8")
        defined = {
            node.name if isinstance(node, ast.FunctionDef) else ast.unparse(node.target)
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.FunctionDef | ast.AnnAssign)
        }
        required = set(re.findall(r"abstractmethod\n    def (\w+)", text))
        words = set(re.findall(r"`(\w+)`", recipe))
        others = {"RawRun", "DescriptionCheck", "SetupCheck"}
        assert required <= words <= defined | others, heading


def test_what_is_missing_is_noticed() -> None:
    text = "make nothing; python -m docs.none; .ci/none; tests/criteria/test_criteria.py::test_none"
    assert len(missing(text)) == 4


def test_pythons_agree() -> None:
    """Classifiers, tests and wheels name the same versions."""
    prefix = "Programming Language :: Python :: 3."
    listed = [c for c in PROJECT["project"]["classifiers"] if c.startswith(prefix)]
    pythons = [name.rpartition(" ")[2] for name in listed]
    tested = loaded(ROOT / ".github/workflows/test.yml")["jobs"]["test"]["strategy"]["matrix"]
    assert tested["python"] == pythons
    built = PROJECT["tool"]["cibuildwheel"]["build"].split()
    assert built == [f"cp{name.replace('.', '')}-*" for name in pythons]
    assert PROJECT["project"]["requires-python"] == f">={pythons[0]}"


def test_there_is_one_version_and_one_home() -> None:
    assert "version" in PROJECT["project"]["dynamic"]
    assert PROJECT["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "excite_cli.__version__"}
    cited, urls = loaded(ROOT / "CITATION.cff"), PROJECT["project"]["urls"]
    assert cited["version"] == RECIPE["context"]["version"] == __version__
    assert f"\n## {__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert all(url.startswith(urls["Homepage"]) for url in urls.values())
    assert cited["repository-code"] == urls["Homepage"]
    assert f"git clone {urls['Homepage']}\n" in CONTRIBUTING


def test_the_recipe_of_conda_asks_for_the_same() -> None:
    """What pip installs of the program, of figures and of the simulation, by conda's names."""
    extras = PROJECT["project"]["optional-dependencies"]
    asked = [*PROJECT["project"]["dependencies"], *extras["plot"], *extras["sim"]]
    named = {RENAMED.get(name, name): floor for name, floor in (each.split(">=") for each in asked)}
    run = [each.split(" >=") for each in RECIPE["requirements"]["run"] if each != "python"]
    assert dict(run) == named
    (backend,) = PROJECT["build-system"]["requires"]
    assert backend.replace(">", " >") in RECIPE["requirements"]["host"]


def test_there_is_one_home() -> None:
    home = PROJECT["project"]["urls"]["Homepage"]
    assert all(url.startswith(home) for url in PROJECT["project"]["urls"].values())
    assert loaded(ROOT / "CITATION.cff")["repository-code"] == home
    assert f"git clone {home}\n" in CONTRIBUTING


def test_hooks_are_the_tools_of_lint() -> None:
    (local,) = loaded(ROOT / ".pre-commit-config.yaml")["repos"]
    assert local["repo"] == "local"
    programs = {hook["entry"].split()[0].removeprefix(".venv/bin/") for hook in local["hooks"]}
    (lint,) = re.findall(
        r"^lint: .*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE
    )
    assert programs == set(re.findall(r"\$\(BIN\)/([\w-]+)", lint))


def installs(text: str) -> list[str]:
    """What is to be installed by every `pip install …` of a text, in quotes if it is so there."""
    return re.findall(r"pip install ('[^']*'|[\w.\[\],-]+\w\]?)", text)


def told_in(path: Path) -> list[str]:
    """Texts of a module or a page; those of a module in one piece each."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return [text]
    nodes = ast.walk(ast.parse(text))
    return [
        "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
        if isinstance(node, ast.JoinedStr)
        else node.value
        for node in nodes
        if isinstance(node, ast.JoinedStr)
        or (isinstance(node, ast.Constant) and isinstance(node.value, str))
    ]


def test_what_messages_say_to_install_is_there() -> None:
    """The package by its name at pip, quoted for a shell, with an extra that has the library."""
    extras, name = PROJECT["project"]["optional-dependencies"], PROJECT["project"]["name"]
    plain = {re.split(r"[^\w-]", each)[0] for each in PROJECT["project"]["dependencies"]}
    plain |= OTHERS | {"."}
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md"]
    seen = set()
    for path in (*(ROOT / "excite_cli").rglob("*.py"), *pages):
        for asked in (asked for text in told_in(path) for asked in installs(text)):
            if asked in plain or asked.startswith(("figaroh", "'mujoco[sysid]'", "-")):
                continue
            found = re.fullmatch(rf"'{name}\[(\w+)\]'", asked)
            assert found is not None, f"{path.relative_to(ROOT)}: pip install {asked}"
            own = {re.split(r"[^\w-]", each)[0] for each in extras[found[1]]}
            source = path.read_text(encoding="utf-8").lower()
            if path.suffix == ".py":
                assert any(each in source for each in own), f"{path.name}: {found[1]}"
            seen.add(found[1])
    assert {"plot", "bags", "parquet", "view", "sim", "cluster", "formats"} <= seen


def pins() -> dict[str, list[Requirement]]:
    """Pinned requirements by name, each with its hash; one with markers may have versions."""
    found: dict[str, list[Requirement]] = {}
    text = re.sub(r"\s*\\\n\s*", " ", PINNED.read_text(encoding="utf-8"))
    for line in re.findall(r"^[^\s#].*", text, re.MULTILINE):
        assert " --hash=sha256:" in line, f"no hash: {line}"
        each = Requirement(line.split(" --hash")[0])
        found.setdefault(canonicalize_name(each.name), []).append(each)
    return found


def test_every_dependency_is_pinned_within_its_range() -> None:
    """Of the program, of its extras and of what builds it."""
    project, again = PROJECT["project"], f"{PINNED.name} is out of date: run `make lock`"
    asked = [*project["dependencies"], *PROJECT["build-system"]["requires"]]
    asked += [text for extra in project["optional-dependencies"].values() for text in extra]
    pinned = pins()
    for wanted in map(Requirement, asked):
        name = canonicalize_name(wanted.name)
        if name == project["name"]:
            continue
        assert name in pinned, f"{name} is not pinned: {again}"
        for each in pinned[name]:
            (exact,) = each.specifier
            assert exact.operator == "=="
            assert wanted.specifier.contains(exact.version, prereleases=True), f"{wanted}: {again}"
