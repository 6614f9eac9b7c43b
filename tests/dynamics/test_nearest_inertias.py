"""The nearest real body: feasible, no farther than need be, also where most of it never shows."""

import numpy as np
import pytest

from excite_cli.dynamics.nearest_inertias import nearest_inertias
from excite_cli.dynamics.pseudo_inertia import smallest_eigenvalues
from excite_cli.effects.rare_sizes import half_of

LENGTH = np.array([0.2])
NONE = np.zeros(0, dtype=np.intp)
# m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz of 0.2 kg at (0.1, 0, 0.05) m, Ixx too small.
IMPOSSIBLE = np.array([0.2, 0.02, 0.0, 0.01, 1e-4, 0.0, 1e-3, -1e-3, 0.0, 1e-3])


@pytest.mark.parametrize("seed", range(8))
def test_a_planar_arm_shows_few_of_ten_numbers(seed: int) -> None:
    """By a covariance as a fit gives it, 1e16 times as wide where nothing shows.

    The solver broke off with 41 of 60 such fits, and a payload on a planar arm had no name.
    """
    rng = np.random.default_rng(seed)
    shown = [0, 2, 3, 4, 9][: 3 + seed % 3]
    columns = 1e-16 * rng.normal(size=(200, 10))
    columns[:, shown] += rng.normal(size=(200, len(shown))) * 10 ** rng.uniform(-1, 1, len(shown))
    columns[:, shown[-1]] += columns[:, shown[0]]
    norms = np.linalg.norm(columns, axis=0)
    unit = columns / norms
    inverse = np.linalg.inv(unit.T @ unit + 1e-10 * np.eye(10))
    covariance = 1e-6 * inverse / np.outer(norms, norms)
    start = IMPOSSIBLE + 1e-3 * rng.normal(size=10)
    found = nearest_inertias(half_of(covariance), start, LENGTH, NONE, 1e-6)
    assert found.solved, found.status
    assert smallest_eigenvalues(found.x, LENGTH).min() > 0.0


def test_what_is_possible_stays_and_what_is_not_moves_by_the_least() -> None:
    possible = np.array([1.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.02, 0.0, 0.0, 0.02])
    same = nearest_inertias(np.eye(10), possible, LENGTH, NONE, 1e-6)
    assert (same.distance, same.x.tolist()) == (0.0, possible.tolist())
    negative = possible.copy()
    negative[0] = -0.5
    moved = nearest_inertias(np.eye(10), negative, LENGTH, NONE, 1e-6)
    assert moved.solved
    assert moved.x[0] == pytest.approx(1e-6, abs=1e-6)
    assert moved.distance == pytest.approx(0.25, rel=1e-3)
