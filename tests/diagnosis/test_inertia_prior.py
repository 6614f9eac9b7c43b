"""How near the URDF its inertias are kept: as data left out ask."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.declared_model import KeptInertias, Model
from excite_cli.diagnosis.inertia_prior import SHARES, best_share, with_share
from excite_cli.diagnosis.training import TrainingData
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import FOLDS, prepared
from tests.robot.random_robots import random_robot

SAMPLES, COLUMNS = 60, 20


def data_of(off: float, excited: float, seed: int) -> TrainingData:
    """Torque of inertias that are `off` those known (zero), in their own units, beside unit noise.

    Half of the columns show by `excited`, the others by a hundredth of that.
    """
    rng = np.random.default_rng(seed)
    shown = excited * np.where(np.arange(COLUMNS) % 2, 1.0, 0.01)
    declared = [rng.normal(size=(SAMPLES, 1, COLUMNS)) * shown for _ in FOLDS]
    true = off * rng.normal(size=COLUMNS)
    tau = [(d @ true) + rng.normal(size=(SAMPLES, 1)) for d in declared]
    prior: Array = np.diag([*np.ones(COLUMNS), 0.0])
    runs = tuple(prepared(np.ones((SAMPLES, 1), bool)) for _ in FOLDS)
    nothing = np.zeros_like(prior)
    return TrainingData(runs, FOLDS, tuple(declared), tuple(tau), prior, nothing)


@pytest.mark.parametrize(("off", "least", "most"), [(0.1, 0.3, 0.3), (1.0, 0.3, 3.0)])
def test_as_far_as_the_inertias_are_off(off: float, least: float, most: float) -> None:
    shares = [best_share(data_of(off, 0.5, seed), [], np.ones(1)) for seed in range(12)]
    assert least <= float(np.median(shares)) <= most


def test_inertias_of_another_robot_are_not_kept() -> None:
    assert best_share(data_of(100.0, 1.0, 0), [], np.ones(1)) >= 10.0


def test_a_model_with_its_prior_made_wider() -> None:
    robot = random_robot(3)
    kept = KeptInertias(np.ones(4), np.full(4, 8.0))
    model = replace(Model(robot, find_base_parameters(robot), (), None), prior=kept)
    found = with_share(model, 2.0).prior
    assert found is not None
    assert found.precision == pytest.approx(np.full(4, 2.0))
    assert found.mean is kept.mean
    assert sorted(SHARES) == list(SHARES)
