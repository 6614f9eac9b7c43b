"""What kinds state of themselves agrees with the catalogue and with each other."""

import ast
from pathlib import Path

import numpy as np
import pytest

import excite_cli
from excite_cli.effects.base import Effect, Tier
from excite_cli.effects.catalogue import catalogue
from excite_cli.robot.model import Robot
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

KINDS = catalogue()
NAMES = sorted(KINDS)
STRAIGHT = ("viscous_friction", "coulomb_friction")
APART = ({"backlash", "elasticity"}, {"friction_change", "covariate_friction"})
PACKAGE = Path(excite_cli.__file__).parent


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(9, joints=3, branches=False)


def smallest(kind: type[Effect]) -> Effect:
    """On as few joints as the kind takes, with its usual shape."""
    joints = (0, 1) if kind.scope == "pair" else (0,)
    return kind(joints, kind.planted(1.0, {})[0])


@pytest.mark.parametrize("name", NAMES)
def test_traits_name_only_kinds_of_the_catalogue(name: str) -> None:
    kind = KINDS[name]
    named = {*kind.refines, *kind.excludes, *kind.same_as, *kind.deviates_from, *kind.changes_of}
    named |= set(kind.varies)
    assert named <= set(NAMES) - {name}
    assert kind.prior_cost >= 0.0
    assert not set(kind.settings) & {p.name for p in (*kind.parameters, *kind.shapes)}
    assert not kind.known_by or kind.known_by in {p.name for p in kind.shapes}


def test_what_every_robot_has_is_free_and_asked_for_first() -> None:
    for name, kind in KINDS.items():
        assert (kind.tier == Tier.EVERY_ROBOT) == (name in STRAIGHT)
        assert (kind.prior_cost == 0.0) == (name in STRAIGHT)


def test_kinds_that_come_near_anything_are_asked_for_last_and_dear() -> None:
    dearest = max(kind.prior_cost for kind in KINDS.values() if kind.tier < Tier.LAST)
    for name in ("contact", "cable_force", "friction_drift"):
        assert KINDS[name].tier == Tier.LAST
        assert KINDS[name].prior_cost >= dearest


def test_what_is_refined_is_asked_for_before_or_with_its_refinement() -> None:
    """And is looked up by its kind and one joint: one of one joint, without shape, no parent."""
    for kind in KINDS.values():
        for parent in (KINDS[name] for name in kind.refines):
            assert parent.tier <= kind.tier
            assert parent.scope == "joint"
            assert not parent.shapes
            assert not parent.refines


@pytest.mark.parametrize("one", NAMES)
def test_exclusion_holds_both_ways(one: str) -> None:
    for other in NAMES:
        assert KINDS[one].exclusive_with(KINDS[other]) == ({one, other} in APART)


def test_exclusion_holds_both_ways_if_one_says_so() -> None:
    class Alone(KINDS["spring"]):  # type: ignore[misc, name-defined]
        kind = "alone"
        excludes = ("armature",)

    assert Alone.exclusive_with(KINDS["armature"])
    assert KINDS["armature"].exclusive_with(Alone)
    assert not Alone.exclusive_with(KINDS["spring"])


@pytest.mark.parametrize("name", [name for name in NAMES if KINDS[name].same_as])
def test_the_other_name_of_a_kind_is_the_same_columns(name: str, robot: Robot) -> None:
    signals = signals_of(robot, 300)
    own, others = (
        np.concatenate([KINDS[k]((1,)).columns(signals)[:, 0] for k in kinds], axis=1)
        for kinds in ((name,), KINDS[name].same_as)
    )
    both = np.concatenate([own, others], axis=1)
    ranks = {int(np.linalg.matrix_rank(x)) for x in (own, others, both)}
    assert ranks == {own.shape[1]}


def _texts(tree: ast.AST) -> list[str]:
    return [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]


def _imports(tree: ast.AST) -> list[str]:
    return [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]


@pytest.mark.parametrize(
    "package", ["diagnosis", "simulation", "report", "identification", "export"]
)
def test_packages_above_know_no_kind_by_name(package: str) -> None:
    """A kind of a package is judged, simulated and drawn as one of ours is."""
    own = {f"excite_cli.effects.{path.stem}" for path in (PACKAGE / "effects").glob("*.py")}
    shared = {
        "base",
        "c_code",
        "catalogue",
        "mjcf_parts",
        "place",
        "placing",
        "simulated_robot",
        "parameter",
        "seen",
        "signals",
        "sign",
    }
    of_kinds = own - {f"excite_cli.effects.{name}" for name in shared}
    names = NAMES if package == "diagnosis" else []
    files = sorted((PACKAGE / package).rglob("*.py"))
    assert files
    for path in files:
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        assert not set(_imports(tree)) & of_kinds, path.name
        assert not [name for name in names if name in source], path.name
        if package in ("diagnosis", "simulation"):
            assert not set(_texts(tree)) & (set(NAMES) - {"armature"}), path.name
