"""Signs and sizes that physics allows, rule by rule, and whose parameters are looked at."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.payload import Payload
from excite_cli.effects.seen import Seen
from excite_cli.robot.model import Array

# A robot on which no size is absurd.
LARGE = Seen(np.full(2, 1e12), np.zeros(2), 40.0)
NONNEGATIVE = (
    "viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "stribeck_friction",
    "load_dependent_friction", "armature", "elasticity",
)  # fmt: skip
# Of those with several parameters, which cannot be negative.
SOME_NONNEGATIVE = {
    "asymmetric_friction": (0, 1), "coupled_friction": (1,), "spring": (0,),
    "ripple": (), "cable_force": (), "contact": (),
}  # fmt: skip
WHOLE = ("torque_saturation", "backlash")
# Candidates of 1, 2, 10, 1 and 3 columns, and values with which each is possible.
MIXED = ("viscous_friction", "coupled_friction", "payload", "encoder_offset", "cable_force")


def candidate(kind: str, joints: tuple[int, ...] = (0,)) -> Candidate:
    effect: Effect = catalogue()[kind](joints)
    return Candidate(effect, joints, (np.zeros((1, len(joints), len(effect.parameters))),))


def possible(
    kind: str,
    *values: float,
    joints: tuple[int, ...] = (0,),
    error: float = 1e-15,
    seen: Seen = LARGE,
) -> bool:
    """Whether the candidate may be so, beside three parameters of the declared model.

    All parameters have this standard `error`.
    """
    spread = error**2 * np.eye(3 + len(values))
    allowed = PossibleSizes([candidate(kind, joints)], lambda _, d: d.T @ spread @ d, seen)
    return allowed(np.array([-1.0, -1e9, 7.0, *values]), [0], [0])


@pytest.mark.parametrize("kind", NONNEGATIVE)
def test_friction_and_inertia_are_never_negative(kind: str) -> None:
    assert possible(kind, 1e-9)
    assert possible(kind, 0.0)
    assert possible(kind, 1e9)  # how large depends on the robot
    assert not possible(kind, -1e-9)


def test_friction_that_depends_on_the_angle_takes_no_more_than_there_is() -> None:
    """Of Coulomb friction of its joint, declared or found: friction is nowhere negative."""
    kinds = [("coulomb_friction", (0,)), ("coulomb_friction", (1,)), ("position_friction", (1,))]
    candidates = [candidate(kind, joints) for kind, joints in kinds]
    for error, most in ((1e-15, 5.0), (0.5, 6.0)):  # 6: within two deviations of both
        spread = error**2 * np.eye(6)

        def allowed(values: list[float], chosen: list[int], declared: int = 0, s: Array = spread):
            known = [each.effect for each in candidates[:declared]]
            sizes = PossibleSizes(candidates, lambda _, d: d.T @ s @ d, LARGE, known)
            return sizes(np.array(values), chosen, [2])

        for times, there in ((0.99, True), (1.01, False)):
            at = [0.6 * times * most, -0.8 * times * most]
            assert allowed([-1.0, 1.0, 99.0, 5.0, *at], [0, 1, 2]) == (there or most > 5.0)
            assert allowed([-1.0, 1.0, 99.0, 5.0, *at], [2], declared=2) == (there or most > 5.0)
            assert not allowed([-1.0, 1.0, 7.0, 99.0, *at], [0, 2])  # of another joint
            assert not allowed([-1.0, 1.0, 99.0, 5.0, *at], [2])


@pytest.mark.parametrize("kind", NONNEGATIVE)
def test_a_wrong_sign_of_a_single_parameter_is_refused_whatever_its_error(kind: str) -> None:
    """Within its error it is nothing."""
    assert not possible(kind, -0.1, error=1.0)
    assert not possible(kind, -9.0, error=1.0)


def test_a_payload_is_refused_where_no_body_is_near() -> None:
    """The inertia of a real one of 2.7 kg came out at -0.007 kg·m², a third of one deviation."""
    _, sphere = Payload.planted(2.7, {})
    flat = sphere.copy()
    flat[4] = -0.007
    assert possible("payload", *sphere)
    assert possible("payload", *flat, error=0.02)
    assert possible("payload", *flat, error=1e-5)  # what it explains is its weight
    assert not possible("payload", -2.7, *sphere[1:], error=0.1)
    plate = [0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 5.0]  # no sign is wrong
    assert not possible("payload", *plate, error=0.01)
    assert not possible("payload", *plate, error=2.0)  # and within the error, it is nothing


@pytest.mark.parametrize(
    ("kind", "value"),
    [("coulomb_friction", 1.0), ("stribeck_friction", 1.0), ("torque_offset", -1.0)],
)
def test_no_part_of_a_torque_is_larger_than_the_torque(kind: str, value: float) -> None:
    robot = Seen(np.array([80.0, 1e6]), np.ones(2), 30.0)
    assert possible(kind, 79.9 * value, seen=robot)
    assert not possible(kind, 80.1 * value, seen=robot)


def test_absurd_sizes_are_told_with_their_reason() -> None:
    robot = Seen(np.full(2, 80.0), np.array([20.0, 1.0]), 30.0)
    _, heavy = Payload.planted(31.0, {})
    for kind, values, words in (
        ("payload", heavy / 1e3, "next to nothing"),
        ("payload", heavy, "more than the robot's own 30 kg"),
        ("contact", np.array([3e-3, 0.0, 0.0]), "no touch"),
        ("elasticity", np.array([1.0 / 54.0]), "54 N·m/rad (N/m) would bend by 0.37 rad (m)"),
        ("stribeck_friction", np.array([243.0]), "more than the largest torque"),
        ("base_tilt", np.array([0.3, 0.0]), "is visible"),
        ("viscous_friction", np.array([-3.0]), "cannot be negative"),
        ("torque_delay", np.array([-2e-4]), "-0.2 ms is less than time stamps are true to"),
    ):
        spread = 1e-20 * np.eye(len(values))
        judge = PossibleSizes([candidate(kind)], lambda _, d, s=spread: d.T @ s @ d, robot)
        assert words in judge.why_not(values, [0], [0])
    assert possible("elasticity", 1e-3, seen=robot)
    assert possible("torque_delay", 4e-4, seen=robot, joints=(0, 1))
    assert possible("contact", 3.0, 0.0, 0.0, seen=robot)


@pytest.mark.parametrize("kind", SOME_NONNEGATIVE)
def test_of_several_parameters_those_that_are_sizes_are_never_negative(kind: str) -> None:
    width = len(catalogue()[kind].parameters)
    for at in range(width):
        values = np.ones(width)
        values[at] = -1.0
        assert possible(kind, *values) == (at not in SOME_NONNEGATIVE[kind])


def test_one_negative_parameter_of_several_is_enough() -> None:
    assert possible("coupled_friction", 1.0, 2.0, joints=(0, 1))
    assert possible("coupled_friction", -1.0, 2.0, joints=(0, 1))  # rods move with each other
    assert possible("coupled_friction", -7.9, 2.0, joints=(0, 1))
    assert not possible("coupled_friction", -8.1, 2.0, joints=(0, 1))
    assert not possible("coupled_friction", 1.0, -2.0, joints=(0, 1))
    assert possible("spring", 1.0, -2.0)  # a preload pulls either way
    assert not possible("spring", -1.0, 2.0)


def test_friction_drifts_as_a_whole() -> None:
    """Of opposite signs, rates are possible as far as one of them is zero within its error."""
    for sign in (-1.0, 1.0):
        assert possible("friction_drift", sign * 2.0, 0.0)
        assert possible("friction_drift", 0.0, sign * 2.0)
        assert not possible("friction_drift", sign * 2.0, -sign * 1e-9)
        assert possible("friction_drift", sign * 2.0, -sign * 0.3, error=0.15)
        assert not possible("friction_drift", sign * 2.0, -sign * 0.6, error=0.15)


@pytest.mark.parametrize("kind", ["torque_offset", "ripple", "cable_force", "friction_drift"])
def test_what_has_no_sign_and_no_limit_may_be_anything(kind: str) -> None:
    width = len(catalogue()[kind].parameters)
    assert possible(kind, *[-1e6] * width)
    assert possible(kind, *[1e6] * width)


@pytest.mark.parametrize(
    ("kind", "high"),
    [("encoder_offset", 0.2), ("torque_gain", 0.5), ("torque_delay", 0.1), ("base_tilt", 0.2)],
)
def test_sizes_that_do_not_depend_on_the_robot_have_limits(kind: str, high: float) -> None:
    several, width = (0, 1), len(catalogue()[kind].parameters)
    for sign in (-1.0, 1.0):
        for at in range(width):
            values = np.zeros(width)
            values[at] = sign * high * 0.999
            assert possible(kind, *values, joints=several)
            values[at] = sign * high * 1.001
            assert not possible(kind, *values, joints=several)


def test_one_joint_alone_is_late_by_more_than_a_moment() -> None:
    assert not possible("torque_delay", 1.49e-3)
    assert not possible("torque_delay", -5e-3)
    assert possible("torque_delay", 1.51e-3)
    assert possible("torque_delay", 4e-4, joints=(0, 1))
    assert not possible("torque_delay", 2e-4, joints=(0, 1))


@pytest.mark.parametrize("kind", WHOLE)
def test_what_is_one_by_nature_is_near_one(kind: str) -> None:
    assert possible(kind, 0.6)
    assert possible(kind, 1.5)
    assert not possible(kind, 0.59)
    assert not possible(kind, 1.51)
    assert not possible(kind, -1.0)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.permutations(range(5)), st.integers(1, 5), st.sets(st.integers(0, 4)), st.data())
def test_only_the_added_are_judged_each_by_its_own_parameters(
    order: list[int], count: int, some: set[int], data: st.DataObject
) -> None:
    """One candidate has an impossible value: it is found where it is added, wherever it is."""
    candidates = [candidate(kind) for kind in MIXED]
    chosen = order[:count]
    added = [i for i in chosen if i in some]
    wrong = data.draw(st.sampled_from(chosen))
    values = {i: np.full(candidates[i].width, 0.1) for i in chosen}
    if 2 in values:
        values[2] = Payload.planted(0.1, {})[1]
    declared = np.full(data.draw(st.integers(0, 4)), -5.0)
    spread = 1e-30 * np.eye(100)
    allowed = PossibleSizes(candidates, lambda _, d: d.T @ spread[: len(d), : len(d)] @ d, LARGE)
    assert allowed(np.concatenate([declared, *(values[i] for i in chosen)]), chosen, added)
    # Impossible for friction and for an encoder, but not for the force of a cable.
    values[wrong][0] = -5.0
    found = allowed(np.concatenate([declared, *(values[i] for i in chosen)]), chosen, added)
    assert found == (wrong not in added or MIXED[wrong] == "cable_force")
