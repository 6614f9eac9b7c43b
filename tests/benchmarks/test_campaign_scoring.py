"""What counts as right of a campaign: kind, place and runs, on answers made up by hand."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.battery.judge import differences
from benchmarks.battery.scoring import Answer, Called, Name, Named, Plant, Score, Truth, score

JOINTS = ("j1", "j2", "j3")
TRAINING = ("a", "b", "c", "d")


def truth_of(*there: Plant, friction: str = "none", training: tuple[str, ...] = TRAINING) -> Truth:
    return Truth(there, len(JOINTS), friction, frozenset(training), "j3")


def plant(
    kind: str, *joints: str, runs: str = "", by_run: Mapping[str, float] | None = None
) -> Plant:
    return Plant((kind,), joints, (), frozenset(runs), by_run or {})


def named(kind: str, *joints: str, runs: str = "", aliases: tuple[Called, ...] = ()) -> Named:
    return Named(Called(Name(kind, joints), frozenset(runs)), aliases)


def judged(there: Plant, *names: Named, friction: str = "none", said: str = "") -> Score:
    truth = truth_of(there, friction=friction)
    return score(truth, Answer(names, (), frozenset({said} if said else ())))


@pytest.mark.parametrize(
    ("runs", "right"),
    [("ab", True), ("a", False), ("abc", False), ("cd", False), ("", False), ("abs", False)],
)
def test_a_payload_is_of_exactly_its_runs(runs: str, right: bool) -> None:
    there = plant("payload", "j3", runs="ab")
    result = judged(there, named("payload", *JOINTS, runs=runs))
    assert result.right is right
    assert result.wrong is not right


def test_names_of_parts_of_the_runs_are_right_together() -> None:
    there = plant("payload", "j3", runs="abc")
    assert judged(there, named("payload", "j3", runs="ab"), named("payload", "j3", runs="c")).right
    assert not judged(
        there, named("payload", "j3", runs="ab"), named("payload", "j3", runs="d")
    ).right


def test_a_held_out_run_that_is_loaded_may_be_named() -> None:
    assert judged(plant("payload", "j3", runs="as"), named("payload", "j3", runs="a")).right
    assert judged(plant("payload", "j3", runs="as"), named("payload", "j3", runs="as")).right


def test_of_all_joints_a_payload_is_on_the_last_leaf() -> None:
    everywhere = named("payload", *JOINTS, runs="a")
    assert judged(plant("payload", "j3", runs="a"), everywhere).right
    assert judged(plant("payload", "j2", runs="a"), everywhere).wrong


def test_the_other_runs_are_as_right_where_all_have_it_too() -> None:
    there = plant("torque_offset", "j1", runs="ab")
    others = named("torque_offset", "j1", runs="cd")
    assert not judged(there, others).right
    assert judged(there, others, named("torque_offset", "j1")).right
    friction = plant("coulomb_friction", "j1", runs="ab")
    other = named("coulomb_friction", "j1", runs="cd")
    assert judged(friction, other, friction="declared").right
    assert not judged(friction, other, friction="none").right


def test_a_trend_has_a_name_of_its_own_or_is_a_step() -> None:
    slow = plant("coulomb_friction", "j1", by_run={"a": 4.0, "b": 3.0, "c": 2.0, "d": 1.0})
    assert judged(slow, named("friction_change", "j1")).right
    assert not judged(slow, named("friction_change", "j2")).right
    assert judged(slow, named("coulomb_friction", "j1", runs="ab")).wrong
    step = plant("coulomb_friction", "j1", by_run={"a": 4.0, "b": 1.01, "c": 1.0, "d": 1.0})
    assert judged(step, named("coulomb_friction", "j1", runs="a")).right


def test_an_alias_set_counts_with_its_runs() -> None:
    there = plant("torque_gain", "j1", runs="a")
    alias = Called(Name("torque_gain", ("j1",)), frozenset("a"))
    other = Called(Name("torque_gain", ("j1",)), frozenset("b"))
    assert judged(there, named("spring", "j1", aliases=(alias,))).right
    assert judged(there, named("spring", "j1", aliases=(other,))).wrong
    assert judged(there, named("spring", "j1", aliases=(other,) * 3 + (alias,))).wrong


def test_an_unknown_map_has_no_name_but_is_said() -> None:
    there = Plant(("outside:position_map",), ("j2",), (), nameable=False)
    assert judged(there, said="j2").right
    assert not judged(there, said="j1").right
    assert judged(there, named("spring", "j2")).wrong


def test_friction_in_the_robot_is_true_but_not_required() -> None:
    background = Plant(("coulomb_friction",), ("j1",), (), required=False)
    truth = truth_of(background, friction="undeclared")
    assert score(truth, Answer(())).right
    result = score(truth, Answer((named("coulomb_friction", "j1"),)))
    assert result.names == ("true",)
    assert score(truth, Answer((named("coulomb_friction", "j2"),))).wrong


def test_sizes_are_of_the_same_runs_only() -> None:
    there = Plant(("torque_offset",), ("j1",), (), frozenset("ab"), sizes={"offset": 2.0})
    near, far = ({"offset": (value, 0.5)} for value in (2.9, 3.1))
    called = Called(Name("torque_offset", ("j1",)), frozenset("ab"))
    for sizes, within in ((near, True), (far, False)):
        (size,) = judged(there, Named(called, sizes=sizes)).sizes
        assert size.within is within
    part = Called(Name("torque_offset", ("j1",)), frozenset("a"))
    assert not judged(there, Named(part, sizes=far)).sizes


@pytest.mark.parametrize(("joint", "found", "counts"), [("j1", False, 0), ("j1", True, 1),
                                                        ("j2", False, 1)])  # fmt: skip
def test_sizes_of_friction_beside_what_was_missed_do_not_count(
    joint: str, found: bool, counts: int
) -> None:
    friction = Plant(("coulomb_friction",), ("j1",), (), sizes={"coulomb": 1.0}, required=False)
    spring = plant("spring", joint)
    truth = truth_of(friction, spring, friction="undeclared")
    coulomb = Named(Called(Name("coulomb_friction", ("j1",))), sizes={"coulomb": (1.5, 0.1)})
    names = (coulomb, named("spring", joint)) if found else (coulomb,)
    assert len(score(truth, Answer(names)).sizes) == counts


@pytest.mark.parametrize(
    ("column", "other", "right", "wrong"),
    [
        ("temp", "", True, False),
        ("fan", "", False, True),
        ("fan", "temp", True, False),
        ("", "", False, True),
    ],
)
def test_what_follows_a_column_is_named_with_it(
    column: str, other: str, right: bool, wrong: bool
) -> None:
    name = Name("covariate_friction", ("j1",))
    there = Plant((name.kind,), name.joints, (), covariate="temp")
    aliases = (Called(name, covariate=other),) if other else ()
    result = judged(there, Named(Called(name, covariate=column), aliases))
    assert (result.right, result.wrong) == (right, wrong)


def test_by_what_two_recordings_are_said_to_differ_is_found() -> None:
    """No model has it: which of two recordings is usual is not known."""
    text = "r1 and r2 differ: torque_offset of j1 by -0.05 N·m in r2; friction of j2 and j3 by +1"
    said: Any = SimpleNamespace(findings=[SimpleNamespace(kind="runs_differ", text=text)])
    found = differences(said)
    assert found == {Name("torque_offset", ("j1",)), Name("friction", ("j2", "j3"))}
    truth = truth_of(plant("torque_offset", "j1", runs="b"), training=("a", "b"))
    assert score(truth, Answer((), differences=found)).right
    assert not score(truth, Answer((), differences=frozenset({Name("torque_gain", ("j1",))}))).right
    steady = truth_of(plant("torque_offset", "j1"), training=("a", "b"))
    assert not score(steady, Answer((), differences=found)).right
