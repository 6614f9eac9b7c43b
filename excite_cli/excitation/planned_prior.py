"""A motion that is known but not measured, as earlier data C_0 of the motions to be planned."""

import numpy as np

from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.trajectory.fade import Segment


def planned_stack(problem: Problem, motion: Segment) -> tuple[Stack, str]:
    """The motion's rows as a stack that fits `problem`, and what was made of it in words.

    It is sampled as sparsely as the cost grid, so that a second of it weighs as much as a second of
    the motions to be planned.
    """
    step = float(np.diff(problem.cost_basis.times[:2])[0])
    duration = motion.trajectory.duration
    count = max(2, round(duration / step))
    times = np.minimum(np.arange(count, dtype=float) * step, duration)
    block = problem.objective().block_of(
        times, *motion.trajectory.states(times, motion.coefficients)
    )
    words = f"{duration:.4g} s of motion, {count} samples every {step:.3g} s (as the cost grid)"
    return Stack.empty(problem.columns).with_rows(block), words
