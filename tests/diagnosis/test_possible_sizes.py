"""Signs and sizes that physics allows, rule by rule, and whose parameters are looked at."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.judgement import Seen
from excite_cli.effects.payload import Payload
from excite_cli.robot.model import Array

# A robot on which no size is absurd.
LARGE = Seen(np.full(2, 1e12), np.zeros(2), 40.0)
# Candidates of 1, 2, 10, 1 and 3 columns, and values with which each is possible.
MIXED = ("viscous_friction", "asymmetric_friction", "payload", "encoder_offset", "cable_force")


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

    All parameters have this standard `error`; of what it varies there is more than enough.
    """
    own = candidate(kind, joints)
    varied = own.effect.varied
    declared = [catalogue()[varied]((j,)) for j in joints] if varied else []
    told = np.array([-1.0, -1e9, 7.0, *(1e9 for _ in declared), *values])
    spread = error**2 * np.eye(len(told))
    allowed = PossibleSizes([own], lambda _, d: d.T @ spread @ d, seen, declared)
    return allowed(told, [0], [0])


def test_a_coupled_shaft_has_no_more_viscous_friction_than_either_joint() -> None:
    """Its own share is part of theirs: else the three together would drive the robot."""
    own = candidate("coupled_friction", (0, 1))
    viscous = [catalogue()["viscous_friction"]((j,)) for j in (0, 1)]
    for error, most in ((1e-15, 2.0), (0.5, 2.0 + 2.0 * 0.5 * np.sqrt(2.0))):
        spread = error**2 * np.eye(4)
        sizes = PossibleSizes([own], lambda _, d, s=spread: d.T @ s @ d, LARGE, viscous)

        def allowed(*values: float, sizes: PossibleSizes = sizes) -> bool:
            return sizes(np.array(values), [0], [0])

        for less, more in ((2.0, 5.0), (5.0, 2.0)):
            assert allowed(less, more, 0.99 * most, 3.0)
            assert allowed(less, more, -0.99 * most, 3.0)
            assert not allowed(less, more, 1.01 * most, 3.0)
        assert not allowed(-1.0, 5.0, 0.5, 3.0)  # nothing of a joint that has none


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


def test_absurd_sizes_are_told_with_their_reason() -> None:
    robot = Seen(np.full(2, 80.0), np.array([20.0, 1.0]), 30.0)
    for kind in ("coulomb_friction", "stribeck_friction", "torque_offset"):
        sign = -1.0 if kind == "torque_offset" else 1.0
        assert possible(kind, 79.9 * sign, seen=robot)
        assert not possible(kind, 80.1 * sign, seen=robot), "no part exceeds the whole torque"
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


def test_friction_drifts_as_a_whole() -> None:
    """Of opposite signs, rates are possible as far as one of them is zero within its error."""
    for sign in (-1.0, 1.0):
        assert possible("friction_drift", sign * 2.0, 0.0)
        assert possible("friction_drift", 0.0, sign * 2.0)
        assert not possible("friction_drift", sign * 2.0, -sign * 1e-9)
        assert possible("friction_drift", sign * 2.0, -sign * 0.3, error=0.15)
        assert not possible("friction_drift", sign * 2.0, -sign * 0.6, error=0.15)


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


@pytest.mark.parametrize("kind", [
    "viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "stribeck_friction",
    "load_dependent_friction", "armature", "elasticity",
])  # fmt: skip
def test_friction_and_inertia_are_never_negative(kind: str) -> None:
    """Whatever their error, within which they are nothing; how large depends on the robot."""
    assert all(possible(kind, value) for value in (0.0, 1e-9, 1e9))
    assert not possible(kind, -1e-9)
    assert not possible(kind, -0.1, error=1.0)
    assert not possible(kind, -9.0, error=1.0)


@pytest.mark.parametrize(
    ("kind", "joints", "good", "bad"),
    [
        ("torque_delay", (0,), [1.51e-3], [1.49e-3, -5e-3]),  # one joint alone
        ("torque_delay", (0, 1), [4e-4], [2e-4]),
        ("torque_delay", (0, 1), [0.0999, -0.0999], [0.1001, -0.1001]),
        ("encoder_offset", (0, 1), [0.1998, -0.1998], [0.2002, -0.2002]),
        ("torque_gain", (0, 1), [0.4995, -0.4995], [0.5005, -0.5005]),
        ("base_tilt", (0, 1), [(0.1998, 0), (0, -0.1998)], [(-0.2002, 0), (0, 0.2002)]),
        ("torque_saturation", (0,), [0.6, 1.5], [0.59, 1.51, -1.0]),  # one by nature
        ("backlash", (0,), [0.6, 1.5], [0.59, 1.51, -1.0]),
        ("coupled_friction", (0, 1), [(1, 2), (-1, 2), (-7.9, 2)], [(-8.1, 2), (1, -2)]),
        ("spring", (0,), [(1, 1), (1, -2)], [(-1, 1), (-1, 2)]),  # a preload pulls either way
        ("asymmetric_friction", (0,), [(1, 1)], [(-1, 1), (1, -1)]),
        ("torque_offset", (0,), [-1e6, 1e6], []),  # neither sign nor limit
        ("ripple", (0,), [(-1, 1), (1, -1), (-1e6, -1e6), (1e6, 1e6)], []),
        ("cable_force", (0,), [(-1, 1, 1), (1, 1, -1), (-1e6,) * 3, (1e6,) * 3], []),
        ("contact", (0,), [(-1, 1, 1), (1, -1, 1), (1, 1, -1)], []),
        ("friction_drift", (0,), [(-1e6, -1e6), (1e6, 1e6)], []),
    ],
)
def test_signs_and_limits(
    kind: str, joints: tuple[int, ...], good: list[Any], bad: list[Any]
) -> None:
    for values in good:
        assert possible(kind, *np.atleast_1d(values), joints=joints), values
    for values in bad:
        assert not possible(kind, *np.atleast_1d(values), joints=joints), values
