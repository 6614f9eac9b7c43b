"""Starts are admissible by construction, or the message says what prevents one."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.start import clear_posture, random_direction, random_start
from excite_cli.excitation.task import MotionTask

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _task(*settings: str) -> MotionTask:
    return MotionTask(build_problem(load_spec(CONFIG, list(settings)), CONFIG.parent))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("rest", ["true", "false"])
def test_random_start_is_strictly_admissible_and_seeded(seed: int, rest: str) -> None:
    task = _task(f"trajectory.at_rest={rest}")
    start = clear_posture(task, seed)
    x = random_start(task, start, (seed, 1))
    assert all(value.min() > 0 for value in task.values(task.states(x)))
    assert np.array_equal(x, random_start(task, start, (seed, 1)))
    assert not np.array_equal(x, random_start(task, start, (seed, 2)))


def test_a_clear_posture_is_kept_and_another_is_moved() -> None:
    assert clear_posture(_task(), 1).as_configured
    folded = _task("robot.posture={shoulder_pitch: 2.1, elbow: 2.5}")
    still = folded.states(folded.variables(folded.problem.still(folded.problem.robot.posture)))
    assert min(value.min() for value in folded.values(still)) < 0
    found = clear_posture(folded, 1)
    assert not found.as_configured
    moved = folded.states(folded.variables(folded.problem.still(found.posture)))
    assert all(value.min() > 0 for value in folded.values(moved))


@pytest.mark.parametrize(
    ("setting", "name"),
    [
        ("constraints.balance={kind: disc, radius: 0.001, center: [9, 9]}", "balance"),
        ("constraints.self_collision.margin=5", "self_collision"),
        ("constraints.torque.scale=0.0001", "joint_torque"),
    ],
)
def test_what_stands_in_the_way_is_named(setting: str, name: str) -> None:
    task = _task(setting)
    with pytest.raises(NoAdmissibleMotionError, match=name):
        clear_posture(task, 1)


@pytest.mark.parametrize("slow", [0.0, 0.5, 1.0])
def test_random_directions_have_unit_length_joint_by_joint(slow: float) -> None:
    task = _task()
    x = random_direction(task, np.random.default_rng(3), slow)
    image = (task.metric @ x).reshape(task.n, task.k)
    lengths = np.einsum("jk,jk->j", x.reshape(task.n, task.k), image)
    assert np.allclose(lengths, 1.0)


def test_metric_is_the_mean_square_in_units_of_the_bounds() -> None:
    task = _task("constraints.torque=null", "constraints.self_collision=null")
    rng = np.random.default_rng(0)
    x = random_direction(task, rng)
    states = task.states(x)
    limits, acceleration = task.problem.robot.limits, 10.0
    half = (limits.upper - limits.lower) / 2
    expected = np.mean((states.v / limits.velocity) ** 2 + (states.a / acceleration) ** 2, axis=0)
    bounded = np.isfinite(half)
    expected[bounded] += np.mean((states.q[:, bounded] / half[bounded]) ** 2, axis=0)
    expected += 1e-3 * np.mean(states.q**2, axis=0)  # so that joints without bounds count too
    assert x @ task.metric @ x == pytest.approx(expected.sum())
