"""Gram matrices of the columns that show in a joint's rows, against those of all columns."""

import numpy as np
import pytest

from excite_cli.diagnosis.evidence import Grams, JointGram

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
