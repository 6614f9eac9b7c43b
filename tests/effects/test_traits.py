"""What kinds state of themselves agrees with the catalogue and with each other."""

import ast
from pathlib import Path

import numpy as np
import pytest

import excite_cli
from excite_cli.effects.catalogue import catalogue
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

KINDS = catalogue()
NAMES = sorted(KINDS)
PACKAGE = Path(excite_cli.__file__).parent
ROBOT = random_robot(9, joints=3, branches=False)


@pytest.mark.parametrize("name", NAMES)
def test_traits_name_only_kinds_of_the_catalogue(name: str) -> None:
    kind = KINDS[name]
    named = {*kind.refines, *kind.excludes, *kind.same_as, *kind.deviates_from, *kind.changes_of}
    named |= set(kind.varies)
    assert named <= set(NAMES) - {name}
    assert kind.prior_cost >= 0.0
    assert not set(kind.settings) & {p.name for p in (*kind.parameters, *kind.shapes)}
    assert not kind.known_by or kind.known_by in {p.name for p in kind.shapes}


def test_what_is_refined_is_asked_for_before_or_with_its_refinement() -> None:
    """And is looked up by its kind and one joint: one of one joint, without shape, no parent."""
    for kind in KINDS.values():
        for parent in (KINDS[name] for name in kind.refines):
            assert parent.tier <= kind.tier
            assert parent.scope == "joint"
            assert not parent.shapes
            assert not parent.refines


def test_exclusion_holds_both_ways_if_one_says_so() -> None:
    class Alone(KINDS["spring"]):  # type: ignore[misc, name-defined]
        kind = "alone"
        excludes = ("armature",)

    assert Alone.exclusive_with(KINDS["armature"])
    assert KINDS["armature"].exclusive_with(Alone)
    assert not Alone.exclusive_with(KINDS["spring"])


@pytest.mark.parametrize("name", [name for name in NAMES if KINDS[name].same_as])
def test_the_other_name_of_a_kind_is_the_same_columns(name: str) -> None:
    signals = signals_of(ROBOT, 300)
    own, others = (
        np.concatenate([KINDS[k]((1,)).columns(signals)[:, 0] for k in kinds], axis=1)
        for kinds in ((name,), KINDS[name].same_as)
    )
    both = np.concatenate([own, others], axis=1)
    ranks = {int(np.linalg.matrix_rank(x)) for x in (own, others, both)}
    assert ranks == {own.shape[1]}


@pytest.mark.parametrize(
    "package", ["diagnosis", "simulation", "report", "identification", "export"]
)
def test_packages_above_know_no_kind_by_name(package: str) -> None:
    """A kind of a package is judged, simulated and drawn as one of ours is."""
    of_kinds = {kind.__module__ for kind in KINDS.values()}
    files = sorted((PACKAGE / package).rglob("*.py"))
    assert files
    for path in files:
        source = path.read_text(encoding="utf-8")
        nodes = list(ast.walk(ast.parse(source)))
        assert not {n.module for n in nodes if isinstance(n, ast.ImportFrom)} & of_kinds, path.name
        if package == "diagnosis":
            assert not [name for name in NAMES if name in source], path.name
        if package in ("diagnosis", "simulation"):
            texts = {n.value for n in nodes if isinstance(n, ast.Constant)}
            assert not texts & (set(NAMES) - {"armature"}), path.name
