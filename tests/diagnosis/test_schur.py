"""Gains of all candidates at once are those of each by itself, whatever its columns are."""

import numpy as np
import pytest

from excite_cli.diagnosis.schur import CandidateBases, Gain, Schur

BLOCKS = [[2, 3], [4, 5], [6], [7, 8], [9, 10, 11]]
FIXED, COLUMNS = 2, 12


def schur(seed: int) -> Schur:
    """Candidates of one to three columns: the second has none in the data, the fourth is one."""
    columns = np.random.default_rng(seed).normal(size=(60, COLUMNS + 1))
    columns[:, 4:6] = 0.0
    columns[:, 8] = 2.0 * columns[:, 7]
    gram = columns.T @ columns
    bases = CandidateBases(gram, FIXED, [np.array(block) for block in BLOCKS])
    shared = gram[:FIXED, FIXED:COLUMNS]
    solved = np.linalg.solve(gram[:FIXED, :FIXED], shared)
    left = np.diag(gram)[FIXED:COLUMNS] - np.einsum("kp,kp->p", shared, solved)
    cross = gram[FIXED:COLUMNS, -1] - solved.T @ gram[:FIXED, -1]
    return Schur(bases, (shared, solved), left, cross, np.zeros(len(left), bool))


@pytest.mark.parametrize("seed", range(3))
def test_all_at_once_are_each_by_itself(seed: int) -> None:
    found = schur(seed)
    for i, together in enumerate(found.singles):
        alone = found.gain(i)
        assert together.dof == alone.dof
        assert (together.chi2, together.left) == pytest.approx((alone.chi2, alone.left), rel=1e-9)
    assert [each.dof for each in found.singles] == [2, 0, 1, 1, 3]


def test_an_effect_without_columns_in_the_data_gains_nothing() -> None:
    assert schur(0).singles[1] == Gain(0.0, 0, 0.0)
