"""Gram matrices of the columns that show in a joint's rows, against those of all columns."""

import numpy as np
import pytest

from excite_cli.diagnosis.grams import Grams, JointGram
from excite_cli.diagnosis.noise_model import NoiseModel
from tests.diagnosis.explicit_data import random_candidates, random_data

FOLDS, SIZE = 3, 7


@pytest.fixture
def both() -> tuple[Grams, np.ndarray]:
    """And in full, (F, 2, n, K, K)."""
    rng = np.random.default_rng(4)
    full = np.zeros((FOLDS, 2, 3, SIZE, SIZE))
    joints = []
    for j, active in enumerate(([0, 1, 2], [0, 1, 4, 5], [0, 1])):
        own = rng.normal(size=(FOLDS, 2, len(active) + 1, len(active) + 1))
        at = np.array([*active, SIZE - 1])
        full[:, :, j, at[:, None], at] = own
        joints.append(JointGram(np.array(active), own.reshape(-1, *own.shape[2:])))
    return Grams(joints, SIZE), full


def test_sums_over_folds_and_joints(both: tuple[Grams, np.ndarray]) -> None:
    grams, full = both
    assert grams.total() == pytest.approx(full.sum(axis=(0, 1, 2)))
    assert grams.seen() == pytest.approx(np.einsum("fsjkk->fsk", full).reshape(-1, SIZE))
    assert grams.torque_energy(1) == pytest.approx(full[:, :, 1, -1, -1].sum())


def test_joints_that_are_known_need_not_be_summed_again() -> None:
    """Candidates of one joint beside others: the rows of all other joints stay as they are."""
    data, candidates = random_data(3), random_candidates(3)
    noise = NoiseModel.white(np.array([0.5, 3.0]))
    own = [c for c in candidates if c.rows == (0,)]
    first = [c for c in candidates if c.rows != (0,)]
    assert own
    assert first
    known = data.grams(first, noise, [1])
    found = data.evidence([*first, *own], noise, known)
    anew = data.evidence([*first, *own], noise)
    assert np.array_equal(found.grams.total(), anew.grams.total())
