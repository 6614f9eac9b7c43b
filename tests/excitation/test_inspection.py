"""`check` measures capsules a second time by Pinocchio and coal, and says where the two differ."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.admissible import path_of
from excite_cli.excitation.inspection import Inspection, Look, inspect
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.geometry.obstacle_distances import ObstacleDistances
from excite_cli.geometry.pair_distances import PairDistances

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
AROUND = (
    "constraints.surroundings={floor: -0.6, boxes: {shelf: {size: [0.2, 0.4, 0.05], position: "
    "[0.6, 0, 0.2], orientation: [0.1, 0.2, 0.3]}}, walls: {left: {point: [0, 1.2, 0], normal: "
    "[0.1, -1, 0]}}}"
)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return build_problem(load_spec(CONFIG, [AROUND]), CONFIG.parent)


def _inspected(problem: Problem) -> Inspection:
    still = problem.still(problem.robot.posture)
    alpha = still + 0.15 * np.random.default_rng(3).normal(size=still.shape)
    path = path_of(problem, problem.trajectory, alpha)
    return inspect(problem, path, None, Look(rate=200.0))


def test_both_computations_agree(problem: Problem) -> None:
    found = _inspected(problem)
    assert [each.name for each in found.second] == ["self_collision", "surroundings"]
    for each in found.second:
        assert each.difference < 1e-9
        assert each.agrees
        assert 250 <= each.instants < each.of == 1201
    assert not found.disagreeing


def test_the_worst_margin_is_that_of_the_second_computation(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = _inspected(problem).worst["self_collision"]
    own = PairDistances.distances
    monkeypatch.setattr(PairDistances, "distances", lambda *args, **kw: own(*args, **kw) + 5e-7)
    again = _inspected(problem)
    assert not again.disagreeing
    assert again.worst["self_collision"] == told


@pytest.mark.parametrize(
    ("kind", "name"), [(PairDistances, "self_collision"), (ObstacleDistances, "surroundings")]
)
def test_a_wrong_distance_of_our_own_is_found(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, kind: type, name: str
) -> None:
    """One millimetre too much, for one pair, in a tenth of its range."""
    before, own = _inspected(problem).violations, kind.distances

    def wrong(self: PairDistances, q: States, **kw: float) -> np.ndarray:
        found = own(self, q, **kw).copy()
        column = found[:, 0]
        column[column < np.quantile(column, 0.1)] += 1e-3
        return found

    monkeypatch.setattr(kind, "distances", wrong)
    found = _inspected(problem)
    (off,) = found.disagreeing
    assert off.name == name
    assert off.difference == pytest.approx(1e-3, rel=1e-6)
    assert off.label == next(c for c in problem.constraints if c.name == name).labels[0]
    assert found.violations == before + 1
