"""Parts of the error on held-out data: they add up, and what is refined joins first."""

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.held_out_errors import INERTIAS, HeldOutErrors, error_parts, error_path
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


class Plain:
    """Energies of both sides of each run (n, 2 F) by the number of chosen candidates."""

    def __init__(self, shares: list[list[float]], moves: Any = True) -> None:
        self.shares, self.moves = np.array(shares), moves

    @property
    def in_turn(self) -> "Plain":
        return self

    def energies(self, chosen: tuple[int, ...]) -> Array:
        weights = 7.0 * (1.0 + np.arange(JOINTS))[:, None]
        by_run = np.where(self.moves, weights * np.square(self.shares[len(chosen)]), 0.0)
        return np.stack([0.25 * by_run, 0.75 * by_run], axis=2).reshape(JOINTS, -1)


def path_of(shares: list[list[float]]) -> Any:
    count = len(shares) - 1
    outcome: Any = SimpleNamespace(
        judge=SimpleNamespace(plain=Plain(shares)), data=SimpleNamespace(n=JOINTS)
    )
    return error_path(outcome, tuple(range(count)), made_up(tuple(range(count))))


def test_the_smallest_model_is_within_one_standard_error_of_the_best() -> None:
    last = [0.10, 0.20, 0.30]
    deviation = np.std(last, ddof=1) / np.sqrt(3)
    far, near = 0.2 + 1.01 * deviation, 0.2 + 0.99 * deviation
    path = path_of([[1.0] * 3, [far] * 3, [near] * 3, last, [0.21, 0.2, 0.3]])
    assert path.left_out == pytest.approx((1.0, far, near, 0.2, 0.71 / 3))
    assert (path.best, path.smallest, path.enough) == (3, 2, True)
    assert path.standard_error == pytest.approx(deviation)
    assert len(path.held_out) == 5
    assert not path_of([[1.0, 1.0], [0.1, 0.2]]).enough, "two runs left out are too few"
    assert path_of([[1.0], [0.1]]).standard_error == 0.0
    nothing: Any = None
    assert error_path(nothing, (), nothing) is None
    # Runs that move some joints only count for those. As short moves do; nothing is known where no
    # run says anything.

    moves = np.array([[True, False, False], [False, True, False], [False] * 3])
    outcome: Any = SimpleNamespace(
        judge=SimpleNamespace(plain=Plain([[1.0] * 3, [0.5, 0.1, 0.7]], moves[:JOINTS])),
        data=SimpleNamespace(n=JOINTS),
    )
    path = error_path(outcome, (0,), made_up((0,)))
    assert path is not None
    assert path.left_out == pytest.approx((1.0, 0.3))
    assert not path.enough
    outcome.judge.plain = Plain([[0.0] * 3, [0.0] * 3])
    assert error_path(outcome, (0,), made_up((0,))) is None
