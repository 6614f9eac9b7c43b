"""Signs and sizes that physics allows, rule by rule, and whose parameters are looked at."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.possible_sizes import possible_sizes
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue

NONNEGATIVE = (
    "viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "stribeck_friction",
    "load_dependent_friction", "armature", "elasticity",
)  # fmt: skip
# Of those with several parameters, which cannot be negative.
SOME_NONNEGATIVE = {
    "asymmetric_friction": (0, 1), "coupled_friction": (0, 1), "spring": (0,),
    "payload": (0, 4, 6, 9), "ripple": (), "cable_force": (), "friction_drift": (), "contact": (),
}  # fmt: skip
WHOLE = ("torque_saturation", "backlash")
# Candidates of 1, 2, 10, 1 and 3 columns, and values with which each is possible.
MIXED = ("viscous_friction", "coupled_friction", "payload", "encoder_offset", "cable_force")


def candidate(kind: str, joints: tuple[int, ...] = (0,)) -> Candidate:
    effect: Effect = catalogue()[kind](joints)
    return Candidate(effect, joints, (np.zeros((1, len(joints), len(effect.parameters))),))


def possible(
    kind: str, *values: float, joints: tuple[int, ...] = (0,), early: bool = False
) -> bool:
    """Whether the candidate may be so, beside three parameters of the declared model."""
    allowed = possible_sizes([candidate(kind, joints)], early)
    return allowed(np.array([-1.0, -1e9, 7.0, *values]), [0], [0])


@pytest.mark.parametrize("kind", NONNEGATIVE)
def test_friction_and_inertia_are_never_negative(kind: str) -> None:
    assert possible(kind, 1e-9)
    assert possible(kind, 0.0)
    assert possible(kind, 1e9)  # how large depends on the robot
    assert not possible(kind, -1e-9)


@pytest.mark.parametrize("kind", SOME_NONNEGATIVE)
def test_of_several_parameters_those_that_are_sizes_are_never_negative(kind: str) -> None:
    width = len(catalogue()[kind].parameters)
    for at in range(width):
        values = np.ones(width)
        values[at] = -1.0
        assert possible(kind, *values) == (at not in SOME_NONNEGATIVE[kind])


def test_one_negative_parameter_of_several_is_enough() -> None:
    assert possible("coupled_friction", 1.0, 2.0, joints=(0, 1))
    assert not possible("coupled_friction", -1.0, 2.0, joints=(0, 1))
    assert not possible("coupled_friction", 1.0, -2.0, joints=(0, 1))
    assert possible("spring", 1.0, -2.0)  # a preload pulls either way
    assert not possible("spring", -1.0, 2.0)


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
    assert possible("torque_delay", 1e-4, joints=(0, 1))


@pytest.mark.parametrize("kind", WHOLE)
def test_what_is_one_by_nature_is_near_one(kind: str) -> None:
    for early, low, high in ((False, 0.6, 1.5), (True, 0.18, 6.0)):
        assert possible(kind, low, early=early)
        assert possible(kind, high, early=early)
        assert not possible(kind, 0.99 * low, early=early)
        assert not possible(kind, 1.01 * high, early=early)
    assert not possible(kind, -1.0, early=True)


def test_early_passes_are_no_more_lenient_otherwise() -> None:
    assert not possible("viscous_friction", -1.0, early=True)
    assert not possible("encoder_offset", 0.3, early=True)


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
    declared = np.full(data.draw(st.integers(0, 4)), -5.0)
    allowed = possible_sizes(candidates, False)
    assert allowed(np.concatenate([declared, *(values[i] for i in chosen)]), chosen, added)
    # Impossible for friction and for an encoder, but not for the force of a cable.
    values[wrong][0] = -5.0
    found = allowed(np.concatenate([declared, *(values[i] for i in chosen)]), chosen, added)
    assert found == (wrong not in added or MIXED[wrong] == "cable_force")
