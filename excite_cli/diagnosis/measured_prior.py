"""Measured data as earlier data C_0 of a planned motion."""

import numpy as np

from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.objective import Objective, Stack
from excite_cli.excitation.problem import Problem
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Array, Dataset
from excite_cli.robot.base_joints import BASE_ROWS


def measured_stack(problem: Problem, data: Dataset) -> tuple[Stack, str]:
    """The data as a stack that fits `problem`, and what was made of them in words.

    Filtered motion is sampled as sparsely as the cost grid of a planned one, so that a second of
    recorded motion weighs as much as a second of planned motion.

    A base counts as standing still: what it sways is too little to tell anything.

    Raises
    ------
    FileError
        A run is too short, or nothing in the data can be used.
    """
    processing = choose_processing(
        data.runs, problem.spec.measurement.filter, problem.spec.diagnosis.moving_speed
    )
    runs = prepare_all(data.runs, processing)
    wanted = float(np.diff(problem.cost_basis.times[:2])[0])
    stack, objective = Stack.empty(problem.columns), problem.objective()
    samples = 0
    for run in runs:
        every = max(1, round(wanted / run.step))
        block = _rows(problem, objective, run, every)
        samples += len(run.tau[::every])
        stack = stack.with_rows(block)
    if stack.rows == 0:
        raise FileError("--prior: no sample of the data can be used.")
    plural = "run" if len(runs) == 1 else "runs"
    words = (
        f"{len(runs)} {plural} of measured data, {samples} samples about every {wanted:.3g} s (as "
        f"the cost grid), {stack.rows} usable rows"
    )
    return stack, words


def _rows(problem: Problem, objective: Objective, run: PreparedRun, every: int) -> Array:
    """Usable rows of every `every`-th averaged sample of a run."""
    robot = problem.robot
    base = run.q.shape[1] - robot.n
    if problem.extension.fine:  # time derivatives first, then the average
        block = objective.block_of(run.t, *(x[:, base:] for x in (run.q, run.v, run.a)))
        block = run.averaged(block.reshape(len(run.t), len(robot.rows), -1))[::every]
    else:
        q, v, a = (run.averaged(x[:, base:])[::every] for x in (run.q, run.v, run.a))
        times: Array = np.arange(len(q), dtype=float) * (run.step * every)
        block = objective.block_of(times, q, v, a).reshape(len(q), len(robot.rows), -1)
    names = dict(zip(BASE_ROWS, range(base), strict=False))
    names |= {name: base + j for j, name in enumerate(robot.joint_names)}
    usable = np.zeros(block.shape[:2], dtype=bool)
    missing = [row for row in robot.row_names if row not in names]
    if missing:
        raise ConfigError(
            f"--prior: the data have nothing of {', '.join(missing)}, which robot.rows asks for: "
            "read them with `load_data` and a config whose measurement.wrench says where it is."
        )
    for index, row in enumerate(robot.row_names):
        usable[:, index] = run.usable[::every, names[row]]
    return np.asarray(block[usable])
