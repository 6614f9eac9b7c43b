"""`from excite_cli import …`: light to import, complete, typed."""

import ast
import doctest
import inspect
import pickle
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

import excite_cli
from excite_cli import (
    Case,
    ConfigError,
    FileError,
    Problem,
    load_case,
    load_data,
    load_problem,
    motions_of,
    plan,
    propose,
    read_result,
)
from excite_cli.shown.note import log_note

ROOT = Path(__file__).resolve().parents[1]
SMOKE = ROOT / "configs" / "smoke.yaml"
BRIEF = ["optimizer.max_iterations=8", "sequence.motions=1"]


@pytest.fixture(scope="module")
def problem() -> Problem:
    return load_problem(SMOKE, BRIEF)


def test_importing_the_package_imports_no_room() -> None:
    code = "import sys, excite_cli; print([m for m in sys.modules if m.startswith('excite_cli.')])"
    heavy = "print([m for m in ('numpy', 'pinocchio', 'h5py') if m in sys.modules])"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}; {heavy}"], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["[]", "[]"]


def test_every_public_name_is_there_and_documented() -> None:
    for name in excite_cli.__all__:
        found = getattr(excite_cli, name)
        assert name == "__version__" or found.__doc__, name
        assert not (ROOT / "excite_cli" / name).exists(), f"package {name} would hide it"
    assert set(excite_cli.__all__) <= set(dir(excite_cli))


def test_types_are_those_of_the_names() -> None:
    """What mypy and editors see are the names that there are, from the same packages."""
    tree = ast.parse((ROOT / "excite_cli" / "__init__.py").read_text(encoding="utf-8"))
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {}
    for node in guarded.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            assert alias.asname == alias.name  # else type checkers take it for private
            seen[alias.name] = node.module
    assert seen == {name: f"excite_cli.{home}" for name, home in excite_cli._HOME.items()}


def test_signatures_can_be_read() -> None:
    """Defaults are shown by name, not by the place in memory where they are."""
    for name in excite_cli.__all__:
        found = getattr(excite_cli, name)
        own = [found] if callable(found) else []
        if inspect.isclass(found):
            own += [each for key, each in vars(found).items() if not key.startswith("_")]
        for each in own:
            if (callable(each) and not isinstance(each, type)) or each is found:
                try:
                    told = str(inspect.signature(each))
                except ValueError:
                    continue  # of errors, written in C
                assert not re.search("<function|<object|<lambda| at 0x", told), (name, told)
    assert "tell: " in str(inspect.signature(excite_cli.diagnose))
    assert "= log_note" in str(inspect.signature(excite_cli.diagnose))
    assert pickle.loads(pickle.dumps(log_note)) is log_note


def in_hint(hint: Any) -> Iterator[type]:
    inner = get_args(hint)
    if not inner and isinstance(hint, type):
        yield hint
    for each in inner:
        yield from in_hint(each)


def test_what_functions_return_can_be_imported_beside_them() -> None:
    public = [getattr(excite_cli, name) for name in excite_cli.__all__]
    functions = [each for each in public if inspect.isfunction(each)]
    for kind in (excite_cli.Model, excite_cli.Dataset):
        own = [each for name, each in vars(kind).items() if not name.startswith("_")]
        members = (getattr(each, "fget", getattr(each, "__func__", each)) for each in own)
        functions += [each for each in members if inspect.isfunction(each)]
    seen = 0
    for function in functions:
        for kind in in_hint(get_type_hints(function).get("return")):
            if kind.__module__.startswith("excite_cli."):
                assert kind in public, (function.__qualname__, kind)
                seen += 1
    assert seen > 30


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        excite_cli.optimise  # noqa: B018


def test_a_plan_is_stored_motion_by_motion(problem: Problem, tmp_path: Path) -> None:
    path, told = tmp_path / "arm.h5", []
    result = plan(problem, output=path, progress=lambda k, state: told.append((k, state.iteration)))
    stored = read_result(path)
    assert stored.motions[0].condition_number == result.motions[0].condition_number
    assert stored.config_folder == str(SMOKE.parent)
    assert told
    assert told[0][0] == 1
    with pytest.raises(FileError, match="exists already"):
        plan(problem, output=path)


def test_priors_of_any_kind_are_the_same_data(problem: Problem, tmp_path: Path) -> None:
    first = plan(problem, output=tmp_path / "first.h5")
    by_record = plan(problem, priors=[first])
    by_file = plan(problem, priors=[tmp_path / "first.h5"])
    by_motion = plan(problem, priors=motions_of(first))
    numbers = [r.motions[0].stacked_condition_number for r in (by_record, by_file, by_motion)]
    np.testing.assert_allclose(numbers[1:], numbers[0], rtol=1e-6)
    assert numbers[0] < first.motions[0].condition_number


def test_a_case_is_enough_for_data(tmp_path: Path) -> None:
    case = load_case(SMOKE)
    assert isinstance(case, Case)
    assert case.base.rank == 26
    with pytest.raises(FileError, match=r"no file .*none\.csv"):
        load_data(case, tmp_path / "none.csv")
    with pytest.raises(ConfigError, match="robott"):
        load_case(SMOKE, ["robott.urdf=x"])


def test_a_proposal_can_be_loaded(tmp_path: Path) -> None:
    found = propose(ROOT / "data" / "smoke_arm.urdf", tmp_path)
    (tmp_path / "arm.yaml").write_text(found.text, encoding="utf-8")
    assert load_case(tmp_path / "arm.yaml").robot.joint_names == found.joints


def test_examples_in_docstrings_are_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are run where the repository is."""
    monkeypatch.chdir(ROOT)
    homes = {*excite_cli._HOME.values()}
    modules = {home for home in homes if home.startswith(("api.", "measurement."))}
    found = [doctest.testmod(import_module(f"excite_cli.{home}")) for home in sorted(modules)]
    assert sum(each.attempted for each in found) >= 5
    assert not sum(each.failed for each in found)
