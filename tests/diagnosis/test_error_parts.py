"""Parts of the error on held-out data: they add up, and what is refined joins first."""

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.held_out_errors import INERTIAS, HeldOutErrors, error_parts
from excite_cli.robot.model import Array

JOINTS = 2


class Errors(SimpleNamespace):
    """Errors of every set of those who join, made up."""

    def of(self, joined: tuple[int, ...]) -> Array:
        assert list(joined) == sorted(joined)
        return self.table[joined]


def made_up(who: tuple[int, ...], seed: int = 0) -> Any:
    rng = np.random.default_rng(seed)
    sets = [chosen for size in range(len(who) + 1) for chosen in combinations(sorted(who), size)]
    return Errors(who=who, joints=JOINTS, table={each: rng.uniform(0, 1, JOINTS) for each in sets})


def traced(count: int, parents: dict[int, tuple[int, ...]] | None = None) -> Any:
    known = parents or {}
    return SimpleNamespace(
        judge=SimpleNamespace(parents=[known.get(i, ()) for i in range(count)]),
        chosen=tuple(range(count)),
    )


@pytest.mark.parametrize("who", [(0,), (0, 1), (0, 1, 2, 3), (INERTIAS, 0, 1, 2)])
def test_the_parts_of_a_joint_add_up(who: tuple[int, ...]) -> None:
    errors = made_up(who)
    parts = error_parts(traced(4), errors)
    assert set(parts) == set(who)
    fall = errors.of(()) - errors.of(tuple(sorted(who)))
    assert sum(parts.values()) == pytest.approx(fall, abs=1e-12)


def test_a_part_is_the_mean_over_orders_and_what_is_refined_joins_first() -> None:
    errors = made_up((0, 1), seed=3)
    first, last = errors.of(()) - errors.of((0,)), errors.of((1,)) - errors.of((0, 1))
    found = error_parts(traced(2), errors)[0]
    # A hundred draws: as often first as last, within four deviations.
    assert found == pytest.approx((first + last) / 2, abs=float(np.ptp([first, last])) * 0.2)
    assert not np.allclose(found, first)
    refined = error_parts(traced(2, {0: (1,)}), errors)
    assert refined[1] == pytest.approx(errors.of(()) - errors.of((1,)))
    assert refined[0] == pytest.approx(last)
    both = error_parts(traced(2, {0: (1,), 1: (0,)}), errors)  # each refines the other
    assert sum(both.values()) == pytest.approx(errors.of(()) - errors.of((0, 1)))


def test_errors_are_those_of_the_fitted_columns() -> None:
    """With the reported predictions at both ends, whatever the fit says there."""
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(50, 3))  # columns of one declared parameter and two candidates
    tau = rng.normal(size=50)
    first, last = rng.normal(size=50), rng.normal(size=50)
    fits = {(): [1.0, 0, 0], (0,): [0.5, 2.0, 0], (1,): [0.3, 0, -1.0], (0, 1): [0.1, 1.5, -0.8]}
    lacks = [
        told - rows @ np.array(fits[each])
        for told, each in ((first, ()), (last, (0, 1)))
    ]  # fmt: skip
    block = np.column_stack([rows, *lacks, tau])
    fit: Any = SimpleNamespace(who=(0, 1), parameters=lambda joined: np.array(fits[joined]))
    errors = HeldOutErrors(fit, [block.T @ block, None])

    def relative(prediction: Array) -> float:
        return float(np.linalg.norm(tau - prediction) / np.linalg.norm(tau))

    assert errors.of(())[0] == pytest.approx(relative(first))
    assert errors.of((0, 1))[0] == pytest.approx(relative(last))
    half = rows @ np.array(fits[(0,)]) + (lacks[0] + lacks[1]) / 2
    assert errors.of((0,))[0] == pytest.approx(relative(half))
    assert np.isnan(errors.of((0,))[1])
