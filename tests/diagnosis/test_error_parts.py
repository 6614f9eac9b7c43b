"""Parts of the error on held-out data: they add up, and what is refined joins first."""

from itertools import combinations, pairwise, permutations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.held_out_errors import INERTIAS, HeldOutErrors, _Fit, error_parts
from excite_cli.diagnosis.weighted_fit import WeightedFit
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import FIXED, PRIOR, random_candidates, random_data

JOINTS = 2


class Errors(SimpleNamespace):
    """Errors of every set of those who join, made up."""

    def of(self, joined: tuple[int, ...]) -> Array:
        return self.table[joined]

    def along(self, order: list[int]) -> Array:
        assert sorted(order) == sorted(self.who)
        sets = [tuple(sorted(order[:count])) for count in range(len(order) + 1)]
        return np.array([self.of(each) for each in sets])


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
    fits = np.array([[1.0, 0, 0], [0.5, 2.0, 0], [0.1, 1.5, -0.8]])
    lacks = [told - rows @ each for told, each in ((first, fits[0]), (last, fits[2]))]
    block = np.column_stack([rows, *lacks, tau])
    fit: Any = SimpleNamespace(
        who=(0, 1), first=lambda: fits[0], last=lambda: fits[2], between=lambda order: fits[1:2]
    )
    errors = HeldOutErrors(fit, [block.T @ block, None]).along([0, 1])

    def relative(prediction: Array) -> float:
        return float(np.linalg.norm(tau - prediction) / np.linalg.norm(tau))

    half = rows @ fits[1] + (lacks[0] + lacks[1]) / 2
    assert errors[:, 0] == pytest.approx([relative(each) for each in (first, half, last)])
    assert np.isnan(errors[:, 1]).all()


def test_nobody_who_joins_is_one_error() -> None:
    fit: Any = SimpleNamespace(
        who=(), first=lambda: np.ones(1), last=lambda: np.ones(1), between=lambda order: None
    )
    assert HeldOutErrors(fit, [np.eye(4)]).along([]).shape == (1, 1)


@pytest.mark.parametrize("kept", [0, 2])
def test_models_on_the_way_are_those_that_are_fitted_with_the_weights_of_the_last(
    kept: int,
) -> None:
    """Of all orders, with the URDF's inertias before their fit joins, and without."""
    data, candidates = random_data(2, PRIOR), random_candidates(2)
    fit = WeightedFit(data, candidates)
    sigma = fit([0, 1, 3])[1]
    urdf = np.array([0.3, -0.2])[:kept]
    traced: Any = SimpleNamespace(
        model=SimpleNamespace(by_urdf=urdf, declared=()),
        chosen=(3, 0, 1),
        candidates=[SimpleNamespace(effect=_Wide(each.width)) for each in candidates],
        data=data,
        products=lambda: fit.products([0, 1, 3]),
    )
    way = _Fit(traced, from_urdf=kept > 0)
    ends = FIXED + np.cumsum([0, *(candidates[i].width for i in (0, 1, 3))])
    places = dict(zip((0, 1, 3), (slice(*each) for each in pairwise(ends)), strict=True))
    for order in permutations(way.who):
        for count, found in enumerate(way.between(order), start=1):
            joined = sorted(i for i in order[:count] if i != INERTIAS)
            held = np.zeros(0) if not kept or INERTIAS in order[:count] else urdf
            expected = np.zeros(ends[-1])
            expected[np.r_[(slice(0, FIXED), *(places[i] for i in joined))]] = fit(
                joined, held, sigma
            )[0]
            assert found == pytest.approx(expected, rel=1e-7, abs=1e-10)


class _Wide(SimpleNamespace):
    """An effect of some parameters."""

    def __init__(self, width: int) -> None:
        super().__init__(parameters=(None,) * width)
