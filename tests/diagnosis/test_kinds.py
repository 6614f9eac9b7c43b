"""Tables about kinds agree with the catalogue and with each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.diagnosis import kinds
from excite_cli.diagnosis.kinds import (
    EXCLUDES,
    FIRST,
    LAST_TIER,
    UNUSUAL,
    left_beside,
    tier,
    together,
    unusual,
)
from excite_cli.effects.catalogue import catalogue

NAMES = sorted(catalogue())
STRAIGHT = ("viscous_friction", "coulomb_friction")


def test_tables_name_only_kinds_of_the_catalogue() -> None:
    named = {*UNUSUAL, *LAST_TIER, *FIRST, *EXCLUDES, *EXCLUDES.values(), *kinds._LEFT_AT_LEAST}
    named |= {parent for parents in FIRST.values() for parent in parents}
    assert named <= set(NAMES)


def test_kinds_without_a_price_of_their_own_cost_the_usual() -> None:
    assert all(unusual(name) == UNUSUAL.get(name, 4.0) for name in NAMES)
    assert all(unusual(name) >= 0.0 for name in NAMES)


def test_what_every_robot_has_is_free_and_asked_for_first() -> None:
    for name in NAMES:
        assert (tier(name) == 1) == (name in STRAIGHT)
        assert (unusual(name) == 0.0) == (name in STRAIGHT)


def test_kinds_that_come_near_anything_are_asked_for_last_and_dear() -> None:
    assert {name for name in NAMES if tier(name) == 3} == set(LAST_TIER)
    for name in ("contact", "cable_force", "friction_drift"):
        assert tier(name) == 3
        assert unusual(name) >= max(unusual(n) for n in NAMES if tier(n) < 3)


def test_parents_are_asked_for_before_or_with_what_refines_them() -> None:
    for name, parents in FIRST.items():
        assert name not in parents
        assert all(tier(parent) <= tier(name) for parent in parents)
        assert not any(parent in FIRST for parent in parents)  # one generation: no cycles


def test_parents_are_effects_of_one_joint_without_shape() -> None:
    """A parent is looked up by its kind and one joint of what refines it."""
    for parents in FIRST.values():
        assert all(catalogue()[p].scope == "joint" and not catalogue()[p].shapes for p in parents)


@pytest.mark.parametrize("one", NAMES)
def test_kinds_go_together_both_ways_but_never_with_themselves(one: str) -> None:
    assert not together(one, one)
    for other in NAMES:
        assert together(one, other) == together(other, one)
        apart = {one, other} == {"backlash", "elasticity"} or one == other
        assert together(one, other) != apart


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("viscous_friction", [50.0], 0.0),
        ("spring", [1e3, -1e3], 0.0),
        ("elasticity", [1e-4], 2e-2),
        ("elasticity", [1e3], 2e-2),  # of no angle: the size does not matter
        ("encoder_offset", [0.01], 2e-3),  # (1.5 · 0.01)² is less
        ("encoder_offset", [-0.1], 0.0225),
        ("base_tilt", [0.06, -0.08], 0.0225),
    ],
)
def test_what_a_first_order_column_leaves(kind: str, values: list[float], expected: float) -> None:
    assert left_beside(kind, np.array(values)) == pytest.approx(expected)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(angle=st.floats(-0.5, 0.5), kind=st.sampled_from(NAMES))
def test_a_larger_angle_never_leaves_less(angle: float, kind: str) -> None:
    least, some, more = (left_beside(kind, np.array([k * angle])) for k in (0.0, 1.0, 1.5))
    assert 0.0 <= least <= some <= more
    if kind not in ("encoder_offset", "base_tilt"):
        assert least == more
