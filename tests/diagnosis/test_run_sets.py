"""The runs that an effect is in, told from what every run says alone."""

import itertools

import numpy as np
import pytest

from excite_cli.diagnosis.run_sets import RunEvidence, evidence_by_run, run_sets, sets_looked_at

RUNS, ROWS, WIDTH = 7, 2, 3


def evidence(
    loaded: dict[int, float], noise: float = 0.01, positive: bool = True
) -> tuple[RunEvidence, list[np.ndarray], list[np.ndarray]]:
    """Columns and residuals of runs, some of which carry that many times a body."""
    rng = np.random.default_rng(3)
    columns = [rng.normal(size=(80, ROWS, WIDTH)) for _ in range(RUNS)]
    body = np.array([1.0, 0.3, -0.2])
    residuals = [
        x @ (loaded.get(r, 0.0) * body) + noise * rng.normal(size=x.shape[:2])
        for r, x in enumerate(columns)
    ]
    return evidence_by_run(columns, residuals, range(RUNS), positive), columns, residuals


def masks(sets: list[tuple[int, ...]]) -> np.ndarray:
    return np.array([np.isin(np.arange(RUNS), chosen) for chosen in sets])


@pytest.mark.parametrize("loaded", [{2}, {0, 3, 5}, {4, 5, 6}, {0, 1, 2, 3, 4, 5}])
def test_the_runs_that_carry_it_come_first(loaded: set[int]) -> None:
    found, *_ = evidence(dict.fromkeys(loaded, 1.0))
    assert set(run_sets(found)[0]) == loaded


def test_the_first_set_is_the_best_of_all_there_are() -> None:
    found, *_ = evidence({1: 1.0, 2: 2.0, 5: 0.6})
    everything = [
        chosen for size in range(1, RUNS) for chosen in itertools.combinations(range(RUNS), size)
    ]
    best = found.explained(masks(everything)).max()
    assert found.explained(masks(run_sets(found)[:1]))[0] == pytest.approx(best)
    # Two loads are told apart noise is none and one run tells nothing.
    two, *_ = evidence({2: 1.0, 4: 3.0})
    assert {(4,), (2, 4)} <= set(run_sets(two))
    either_sign, *_ = evidence(dict.fromkeys(range(1, RUNS), 1.0), positive=False)
    assert run_sets(either_sign)[0] == (0,), "it is in the fewer runs"
    none, *_ = evidence({}, noise=1.0)
    assert run_sets(none) == []
    assert run_sets(RunEvidence(np.ones((1, 1, 1)), np.ones((1, 1)), True)) == []
    # Tests grow with the runs.
    assert [sets_looked_at(n) for n in (1, 2, 10)] == [1, 4, 28]


def test_explained_is_what_values_of_their_own_take_off() -> None:
    found, columns, residuals = evidence({1: 1.0}, noise=0.5)

    def left(runs: list[int]) -> float:
        x = np.concatenate([columns[r].reshape(-1, WIDTH) for r in runs])
        y = np.concatenate([(residuals[r]).ravel() for r in runs])
        return float(np.sum((y - x @ np.linalg.lstsq(x, y, rcond=None)[0]) ** 2))

    scale = np.median(np.abs(np.concatenate(residuals)), axis=0)
    columns = [x / scale[:, None] for x in columns]
    residuals = [r / scale for r in residuals]
    expected = left(list(range(RUNS))) - left([1, 4]) - left([0, 2, 3, 5, 6])
    assert found.explained(masks([(1, 4)]))[0] == pytest.approx(expected, rel=1e-5)


def test_sets_that_differ_in_one_run_are_weighed_as_each_alone() -> None:
    rng = np.random.default_rng(3)
    columns = [rng.normal(size=(40, 2, 3)) for _ in range(9)]
    residuals = [rng.normal(size=(40, 2)) for _ in range(9)]
    found = evidence_by_run(columns, residuals, range(9), False)
    for _ in range(5):
        chosen = rng.random(9) > 0.5
        sets = chosen ^ np.eye(9, dtype=bool)
        assert np.allclose(found.toggled(chosen), found.explained(sets), rtol=1e-9)
