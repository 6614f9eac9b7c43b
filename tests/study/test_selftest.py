"""How an answer about a planted effect is judged, and which effects are planted."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.effects.catalogue import catalogue
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.ground_truth import parse_planted
from excite_cli.study.selftest import (
    Name,
    Outcome,
    Said,
    Selftest,
    SelftestCase,
    beside,
    judge,
    predicted,
    spread,
    usual_effects,
)

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
GEARS: Name = ("gear_loss", ("elbow",))
DRY: Name = ("coulomb_friction", ("elbow",))
ELSEWHERE: Name = ("spring", ("slide",))
PARTS = [Said((kind, ("elbow",))) for kind in ("load_dependent_friction", "torque_gain")]


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


@pytest.mark.parametrize(
    ("said", "outcome"),
    [
        ([], Outcome.NOT_FOUND),
        ([Said(GEARS)], Outcome.FOUND),
        ([Said(GEARS), Said(DRY)], Outcome.FOUND),
        ([Said(DRY)], Outcome.NOT_FOUND),  # it was planted beside the gears
        ([Said(GEARS, sure=False)], Outcome.NOT_FOUND),
        ([Said(GEARS, near=True)], Outcome.CONFOUNDED),
        ([Said(GEARS), Said(ELSEWHERE)], Outcome.WRONG),
        ([Said(GEARS), Said(ELSEWHERE, sure=False)], Outcome.FOUND),
        ([Said(GEARS), Said(ELSEWHERE, near=True)], Outcome.FOUND),
        ([Said(ELSEWHERE, (GEARS,))], Outcome.CONFOUNDED),
        ([Said(("spring", ("elbow",)))], Outcome.CONFOUNDED),
        ([Said(("coupled_friction", ("elbow", "slide")))], Outcome.CONFOUNDED),
        (PARTS, Outcome.FOUND),  # together the same torque
        (PARTS[:1], Outcome.CONFOUNDED),
    ],
)
def test_judging(said: list[Said], outcome: Outcome) -> None:
    found, wrong = judge(GEARS, said, [DRY])
    assert found is outcome
    assert wrong == ((ELSEWHERE,) if outcome is Outcome.WRONG else ())


def test_what_inertias_take_up_and_what_the_whole_robot_has() -> None:
    assert judge(GEARS, [], (), [GEARS])[0] is Outcome.CONFOUNDED
    assert judge(GEARS, [], (), [ELSEWHERE])[0] is Outcome.NOT_FOUND
    load = ("payload", ("slide",))  # joints are no part of its name
    assert judge(load, [Said(("payload", ("elbow",)))])[0] is Outcome.FOUND
    assert judge(("spring", ("slide",)), [Said(("spring", ("elbow",)))])[1]


@pytest.mark.parametrize(
    ("named", "apart", "absorbed", "outcome"),
    [
        (1.0, 1.0, True, "confounded"),
        (0.2, 0.0, False, "not found"),
        (0.21, 0.2, False, "confounded"),
        (0.9, 0.9, False, "found"),
        (0.9, 0.8, False, "open"),
        (0.5, 1.0, False, "open"),
    ],
)
def test_the_outcome_that_is_predicted(
    named: float, apart: float, absorbed: bool, outcome: str
) -> None:
    assert predicted(named, apart, absorbed) == outcome


def test_usual_effects_are_those_of_many_robots(robot: Robot) -> None:
    found = usual_effects(robot, (), 1)
    kinds = {each.effect.kind for each in found}
    assert {"coulomb_friction", "armature", "stribeck_friction"} <= kinds
    assert not {"payload", "contact", "spring", "ripple", "friction_change"} & kinds
    assert all(catalogue()[kind].scope == "joint" for kind in kinds)
    assert len(found) == len(kinds) * robot.n
    assert all(abs(each.named()[each.number]) > 0 for each in found)
    declared = found[0].effect
    assert len(usual_effects(robot, [declared], 1)) == len(found) - 1


def test_cases_are_spread_and_follow_the_seed(robot: Robot) -> None:
    every = usual_effects(robot, (), 1)
    chosen = spread(every, 5, 1)
    assert len({each.effect.kind for each in chosen}) == 5
    assert len({each.effect.joints for each in chosen}) == 5
    assert chosen == spread(every, 5, 1)
    assert chosen != spread(every, 5, 2)
    assert len(spread(every, 1000, 1)) == len(every)


def test_words_of_a_planted_effect_are_read_again(robot: Robot) -> None:
    for each in usual_effects(robot, (), 1):
        (again,) = parse_planted(each.in_words(robot.joint_names), robot, {})
        assert again.effect.place == each.effect.place
        assert again.values == pytest.approx(each.values, rel=1e-5)


def test_what_an_effect_refines_comes_with_it(robot: Robot) -> None:
    (planted,) = parse_planted("stribeck_friction@elbow=1", robot, {})
    more = beside(planted, robot, ())
    assert [each.effect.kind for each in more] == list(planted.effect.refines)
    assert all(each.effect.joints == planted.effect.joints for each in more)
    assert beside(planted, robot, [each.effect for each in more]) == []


def test_what_an_effect_takes_from_comes_beside_what_is_declared(robot: Robot) -> None:
    """Of the declared friction there may be less than the bristle takes."""
    (planted,) = parse_planted("dahl_friction@elbow=1", robot, {})
    declared = [each.effect for each in beside(planted, robot, ())]
    assert [each.kind for each in declared] == ["coulomb_friction"]
    assert [each.effect for each in beside(planted, robot, declared)] == declared


def test_a_case_that_failed_is_bad() -> None:
    case = SelftestCase("armature@elbow=1", "armature", ("elbow",), 1.0, message="no way")
    assert not Selftest("arm", ("elbow",), (case,), 1).good
