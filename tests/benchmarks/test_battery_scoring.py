"""What counts as found, wrong and extra, on answers made up by hand."""

import pytest

from benchmarks.battery.scoring import Answer, Called, Name, Named, Plant, Score, Truth
from benchmarks.battery.scoring import score as scored

JOINTS = 6


def score(there: list[Plant], answer: Answer, friction: bool, joints: int) -> Score:
    return scored(Truth(there, joints, "declared" if friction else "none"), answer)


def plant(kind: str, *joints: str, companions: tuple[Name, ...] = ()) -> Plant:
    return Plant((kind,), joints, companions=companions, touched=joints)


def named(kind: str, *joints: str, aliases: tuple[str, ...] = ()) -> Named:
    return Named(Called(Name(kind, joints)), tuple(Called(Name(a, joints)) for a in aliases))


def test_kind_and_joint_must_both_be_true() -> None:
    there = [plant("spring", "j2")]
    good = score(there, Answer((named("spring", "j2"),)), True, JOINTS)
    assert good.right
    assert good.detected
    assert not good.wrong
    elsewhere = score(there, Answer((named("spring", "j3"),)), True, JOINTS)
    assert not elsewhere.right
    assert not elsewhere.detected
    assert elsewhere.wrong
    other = score(there, Answer((named("armature", "j2"),)), True, JOINTS)
    assert other.detected
    assert not other.right
    assert other.wrong


@pytest.mark.parametrize(("others", "right"), [(0, True), (2, True), (3, False)])
def test_an_alias_set_counts_if_it_is_small(others: int, right: bool) -> None:
    aliases = ("spring", *["ripple"] * others)
    result = score(
        [plant("spring", "j2")], Answer((named("armature", "j2", aliases=aliases),)), True, JOINTS
    )
    assert result.right is right
    assert result.wrong is not right


def test_asymmetric_friction_is_an_offset_beside_declared_friction() -> None:
    there = [plant("asymmetric_friction", "j1")]
    offset, coulomb = named("torque_offset", "j1"), named("coulomb_friction", "j1")
    assert score(there, Answer((offset,)), True, JOINTS).right
    assert not score(there, Answer((offset,)), False, JOINTS).right
    both = score(there, Answer((offset, coulomb)), False, JOINTS)
    assert both.right
    assert not both.wrong


def test_plain_friction_beside_a_refinement_is_extra_where_none_is_declared() -> None:
    there = [plant("stribeck_friction", "j1")]
    answer = Answer((named("stribeck_friction", "j1"), named("coulomb_friction", "j1")))
    result = score(there, answer, False, JOINTS)
    assert result.right
    assert result.extra
    assert not result.wrong
    assert score(there, answer, True, JOINTS).wrong
    apart = Answer((named("stribeck_friction", "j1"), named("coulomb_friction", "j2")))
    assert score(there, apart, False, JOINTS).wrong


def test_companions_are_true_but_not_required() -> None:
    own = Name("viscous_friction", ("j1",))
    there = [plant("coupled_friction", "j1", "j2", companions=(own,))]
    pair, viscous = named("coupled_friction", "j1", "j2"), named("viscous_friction", "j1")
    result = score(there, Answer((pair, viscous)), False, JOINTS)
    assert result.right
    assert result.names == ("true", "companion")
    assert not score(there, Answer((viscous,)), False, JOINTS).right


def test_of_what_acts_on_the_whole_robot_the_kind_is_enough() -> None:
    every = tuple(f"j{k}" for k in range(JOINTS))
    for kind in ("payload", "torque_delay"):
        result = score([plant(kind, *every)], Answer((named(kind, "j1"),)), True, JOINTS)
        assert result.right
    one = score([plant("torque_delay", "j1")], Answer((named("torque_delay", *every),)), True, 6)
    assert not one.right


def test_two_effects_must_both_be_found() -> None:
    there = [plant("spring", "j2"), plant("armature", "j3")]
    half = score(there, Answer((named("spring", "j2"),)), True, JOINTS)
    assert half.found == (True, False)
    assert not half.right
    assert half.detected
    whole = Answer((named("spring", "j2"),), absorbed=(Name("armature", ("j3",)),))
    assert score(there, whole, True, JOINTS).right


def test_unexplained_counts_as_detected_on_the_right_joint_only() -> None:
    there = [plant("outside:hysteresis", "j2")]
    good = score(there, Answer((), said=frozenset({"j2"})), True, JOINTS)
    assert good.detected
    assert good.there
    assert not good.right
    assert not score(there, Answer((), said=frozenset({"j3"})), True, JOINTS).detected


def test_clean_data_have_nothing_to_be_right_about() -> None:
    result = score([], Answer((named("spring", "j2"),)), True, JOINTS)
    assert result.wrong
    assert not result.detected


def test_saturation_may_be_told_by_the_checks_of_the_data() -> None:
    there = [plant("torque_saturation", "j2")]
    assert score(there, Answer((), saturated=frozenset({"j2"})), True, JOINTS).right
    assert not score(there, Answer((), saturated=frozenset({"j1"})), True, JOINTS).right


def test_an_approximation_is_neither_right_nor_wrong_but_is_seen() -> None:
    there = [plant("spring", "j2")]
    near = Named(Called(Name("spring", ("j2",))), approximation=True)
    result = score(there, Answer((near,)), True, JOINTS)
    assert result.names == ("approximation",)
    assert not result.right
    assert not result.wrong
    assert result.detected
