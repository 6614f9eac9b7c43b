"""Measured data as earlier data: the same information as the planned motion they come from."""

import numpy as np
import pytest

from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.measurement.dataset import Dataset, Run
from tests.diagnosis.synthetic_diagnosis import CONFIG, smoke_spec

RATE = 200.0


def _problem(*changes: str) -> Problem:
    return build_problem(smoke_spec(*changes), CONFIG.parent)


def _recorded(problem: Problem, periods: int = 6, noise: float = 0.0) -> tuple[Dataset, np.ndarray]:
    """A periodic motion played `periods` times, and its coefficients."""
    rng = np.random.default_rng(8)
    alpha = problem.still(problem.robot.posture)
    alpha = alpha + 0.1 * rng.normal(size=alpha.shape)
    times = np.arange(0.0, periods * problem.trajectory.duration, 1 / RATE)
    q, _, _ = problem.trajectory.basis(times).states(alpha)
    q = q + noise * rng.normal(size=q.shape)
    run = Run("run_1", times, q, np.zeros_like(q))
    return Dataset(problem.robot.joint_names, (run,)), alpha


@pytest.mark.parametrize(
    "effects",
    ["[]", "[{kind: viscous_friction}, {kind: spring}]", "[{kind: torque_delay}]"],
)
def test_a_second_of_data_weighs_as_much_as_a_second_of_motion(effects: str) -> None:
    """Time derivatives, of which a delay is made, are taken before the average."""
    problem = _problem(f"effects={effects}")
    data, alpha = _recorded(problem)
    stack, words = measured_stack(problem, data)
    block = problem.objective().block(alpha)
    gram, planned = stack.factor.T @ stack.factor, block.T @ block
    share = stack.rows / len(block)
    assert 4.5 < share < (8.0 if "delay" in effects else 6.0)  # the borders are cut
    ratio = np.diag(gram) / (share * np.diag(planned))
    assert np.abs(np.log(ratio)).max() < np.log(1.25)
    if "delay" not in effects:
        assert np.allclose(gram, share * planned, atol=0.05 * share * np.abs(planned).max())
    assert "1 run of measured data" in words


def test_samples_that_are_not_valid_do_not_count() -> None:
    problem = _problem()
    data, _ = _recorded(problem)
    run = data.runs[0]
    valid = np.ones_like(run.q, dtype=bool)
    valid[:, 2] = False
    masked = Run(run.name, run.t, run.q, run.tau, valid=valid)
    whole, _ = measured_stack(problem, data)
    less, _ = measured_stack(problem, Dataset(data.joint_names, (masked,)))
    assert less.rows == 4 / 5 * whole.rows
    none = Run(run.name, run.t, run.q, run.tau, valid=np.zeros_like(valid))
    with pytest.raises(FileError, match="no sample"):
        measured_stack(problem, Dataset(data.joint_names, (none,)))


def test_a_robot_that_measures_its_base_only() -> None:
    problem = _problem("robot.base=floating", "robot.rows=[base]")
    data, _ = _recorded(problem)
    with pytest.raises(ConfigError, match=r"robot\.rows"):
        measured_stack(problem, data)
