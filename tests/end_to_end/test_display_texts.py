"""Texts are for people: with every one of them replaced, no figure of a diagnosis or plan changes.

Replaced is whatever the program puts into words: functions of the files of words, titles of
effects, labels of runs, names in words, sentences of findings.
"""

import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass, replace
from functools import wraps
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import excite_cli as api
import excite_cli.summary
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.excitation.result import Result
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.robot.model import Robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.simulated_arm import motion

for summarised in pkgutil.iter_modules(excite_cli.summary.__path__, "excite_cli.summary."):
    import_module(summarised.name)  # words are replaced in what is imported

JUNK = "q[elbow] 6-12 s (first half): always in contact"  # looks like much, and means nothing
ELBOW = 2
# Fields of records that hold words; all others are compared.
PROSE = {"text", "base_names", "base_words", "reasons", "note", "dropped_pairs", "verdict"}
FREE = {"seconds", "versions"}
WORDS = ("in_words", "label", "sentence")


def junk(value: Any) -> Any:
    """The same with every text replaced."""
    if isinstance(value, tuple | list):
        return type(value)(map(junk, value))
    return JUNK if isinstance(value, str) else value


def speechless(function: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(function)
    def told(*arguments: Any, **options: Any) -> Any:
        return junk(function(*arguments, **options))

    return told


def puts_into_words(value: Any) -> bool:
    """Whether a function of a module is there to make words."""
    if not isinstance(value, FunctionType) or not value.__module__.startswith("excite_cli"):
        return False
    if value.__name__.endswith("in_words"):
        return True
    return value.__module__.endswith("words") and "str" in str(
        inspect.signature(value).return_annotation
    )


@contextmanager
def without_words() -> Iterator[int]:
    """Every text replaced; how many places were."""
    count = 0
    with pytest.MonkeyPatch.context() as patch:

        def put(place: Any, name: str, value: Any) -> None:
            nonlocal count
            count += 1
            patch.setattr(place, name, value)

        modules = [m for name, m in sys.modules.items() if name.startswith("excite_cli") and m]
        for module in modules:
            for name, value in list(vars(module).items()):
                if puts_into_words(value):
                    put(module, name, speechless(value))
                if not (inspect.isclass(value) and value.__module__ == module.__name__):
                    continue
                for attribute in set(WORDS) & set(vars(value)):
                    told = vars(value)[attribute]
                    if isinstance(told, property):
                        assert told.fget is not None
                        put(value, attribute, property(speechless(told.fget)))
                    elif isinstance(told, FunctionType):
                        put(value, attribute, speechless(told))
        for kind in catalogue().values():
            put(kind, "title", JUNK)
            put(kind, "signature", JUNK)
        made = Finding.__init__

        def silent(
            finding: Finding, kind: str, how: Any, text: str, *rest: Any, **more: Any
        ) -> None:
            made(finding, kind, how, JUNK, *rest, **more)

        patch.setattr(Finding, "__init__", silent)
        yield count


def parts(value: Any) -> dict[Any, Any] | None:
    """What a record is made of, prose left out; None of a single value."""
    if is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in fields(value)}
    elif isinstance(value, tuple | list):
        value = dict(enumerate(value))
    if not isinstance(value, dict):
        return None
    return {name: each for name, each in value.items() if name not in PROSE | FREE}


def differences(one: Any, other: Any, where: str = "") -> list[str]:
    """Where two records differ in what is no prose."""
    if type(one) is not type(other):
        return [f"{where}: {type(one)} {type(other)}"]
    inside, beside = parts(one), parts(other)
    if inside is not None and beside is not None:
        if set(inside) != set(beside):
            return [f"{where}: {set(inside) ^ set(beside)}"]
        return [d for k in inside for d in differences(inside[k], beside[k], f"{where}[{k}]")]
    if isinstance(one, np.ndarray):
        return [] if np.array_equal(one, other, equal_nan=one.dtype.kind == "f") else [where]
    same = one == other or (one != one and other != other)
    return [] if same else [f"{where}: {one} {other}"]


def recorded(robot: Robot) -> Dataset:
    """Three runs, an offset in the second; on the elbow a torque that no effect has by name."""
    names = ("take 1-6 s", "take 6-12 s", "take 7-18 s")
    motions = [replace(motion(k + 1), name=name) for k, name in enumerate(names)]
    offset = plant(kind_named("torque_offset"), (1,), 6.0, {})
    offset = replace(offset, effect=replace(offset.effect, runs=(names[1],)))
    settings = SimulationSettings(rate=200.0, lead_in=0.5)
    dataset = simulate(robot, motions, settings, [offset]).dataset

    def bent(run: Run) -> Run:
        away = run.q[:, ELBOW] - dataset.runs[0].q[:, ELBOW].mean()
        curve = 40.0 * away + 400.0 * away**3
        return replace(run, tau=run.tau + np.outer(curve, np.eye(robot.n)[ELBOW]))

    return replace(dataset, runs=tuple(map(bent, dataset.runs)))


def diagnosed(folder: Path) -> Diagnosis:
    problem = api.load_problem(
        SMOKE,
        [
            'effects=[{kind: torque_offset, joints: [shoulder_pitch], runs: ["take 6-12 s"]}]',
            "diagnosis.kinds=[spring, viscous_friction, coulomb_friction, payload]",
        ],
    )
    dataset = recorded(problem.robot)
    found = api.diagnose(problem, dataset, output=folder / "diagnosis.h5")
    again = api.read_diagnosis(folder / "diagnosis.h5")
    assert not differences(found.effects, again.effects)
    return found


def planned(folder: Path) -> Result:
    few = ["optimizer.max_iterations=6", "sequence.motions=2"]
    return api.plan(api.load_problem(SMOKE, few))


@pytest.mark.parametrize("work", [diagnosed, planned])
def test_no_text_decides_anything(
    work: Callable[[Path], Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for name in ("plain", "junk"):  # nothing is known from before
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / name))
        (tmp_path / name).mkdir()
        if name == "plain":
            found.append(work(tmp_path / name))
            continue
        with without_words() as count:
            assert count > 80
            found.append(work(tmp_path / name))
    first, second = found
    assert differences(first, second) == []
    words = "base_names" if work is diagnosed else "base_words"
    assert set(getattr(second, words)) == {JUNK} != set(getattr(first, words))


def test_what_is_diagnosed_needs_every_judgement_that_texts_once_made(tmp_path: Path) -> None:
    """The case above holds an approximation by its covariates and an effect of a single run."""
    found = diagnosed(tmp_path)
    doubted = {each.effect.kind: each.approximates for each in found.effects if each.approximates}
    assert doubted["spring"] is not None
    assert [c.code for c in doubted["spring"].covariates] == ["q[elbow]"]
    (offset,) = [each for each in found.information.model if each.kind == "torque_offset"]
    assert offset.values[0] == pytest.approx(6.0, abs=0.2)
