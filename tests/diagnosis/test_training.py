"""Columns of a model in one joint's rows."""

import numpy as np
import pytest

from tests.diagnosis.explicit_data import FIXED, FOLDS, random_candidates, random_data


@pytest.mark.parametrize("chosen", [(), (0,), (2,), (1, 3), (3, 2, 0), (4, 1)])
@pytest.mark.parametrize("joint", [0, 1])
def test_columns_times_parameters_are_the_model_of_that_joint(
    chosen: tuple[int, ...], joint: int
) -> None:
    """Against torque added up effect by effect, sample by sample."""
    data, candidates = random_data(11), random_candidates(11)
    widths = [candidates[i].width for i in chosen]
    theta = np.random.default_rng(0).normal(size=FIXED + sum(widths))
    starts = FIXED + np.cumsum([0, *widths])
    for part in range(len(FOLDS)):
        found = data.columns(candidates, chosen, part, joint)
        assert found.shape == (len(data.tau[part]), FIXED + sum(widths))
        for t in range(0, len(data.tau[part]), 7):
            expected = float(data.declared[part][t, joint] @ theta[:FIXED])
            for i, start in zip(chosen, starts, strict=False):
                own = candidates[i]
                values = theta[start : start + own.width]
                for row, acts_on in enumerate(own.rows):
                    if acts_on == joint:
                        expected += float(own.columns[part][t, row] @ values)
            assert found[t] @ theta == pytest.approx(expected)


def test_columns_and_residuals_say_the_same() -> None:
    data, candidates = random_data(12), random_candidates(12)
    chosen = (3, 2, 1)
    theta = np.random.default_rng(1).normal(size=FIXED + 4)
    for part, rest in enumerate(data.residuals(candidates, chosen, theta)):
        assert np.array_equal(data.tau[part], random_data(12).tau[part]), "untouched"
        for joint in range(data.n):
            model = data.columns(candidates, chosen, part, joint) @ theta
            assert rest[:, joint] == pytest.approx(data.tau[part][:, joint] - model)
