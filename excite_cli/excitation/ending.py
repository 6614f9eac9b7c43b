"""When a sequence of motions ends: a precision is reached, or the time is spent."""

from functools import cached_property

import numpy as np

from excite_cli.config.spec import SequenceSpec
from excite_cli.errors import ConfigError
from excite_cli.excitation.free_design import FreeDesign
from excite_cli.excitation.invariant import Invariants, design_for, invariants
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack

# Durations that agree to rounding are equal: three motions of 10 s are within 30 s.
_ROUNDING = 1e-9
# Beyond this condition number the information cannot be inverted: nothing is precise yet.
_SINGULAR = 1e7


_MOST = 20  # motions where a precision or a time is asked for, and no number


def most_motions(sequence: SequenceSpec) -> int:
    """Motions, or the most of them where `until` may end them earlier."""
    return sequence.motions or (1 if sequence.until is None else _MOST)


class Ending:
    """What `sequence` of a problem asks for, and whether a result has it.

    Raises
    ------
    ConfigError
        The precision of a robot is asked for where a load is excited, or not one motion is as
        short as `until.duration`.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._until = problem.spec.sequence.until
        if self._precise and problem.spec.criterion.of != "robot":
            raise ConfigError(
                "sequence.until: torque_deviation and efficiency are those of a robot's "
                f"parameters, and criterion.of is {problem.spec.criterion.of}. Leave them out."
            )
        if self.most == 0:
            assert self._until is not None
            raise ConfigError(
                f"sequence.until.duration: one motion takes {problem.trajectory.duration:.4g} s, "
                f"and the time of all is {self._until.duration:g} s. Allow more, or give a shorter "
                "trajectory."
            )

    @property
    def most(self) -> int:
        """Motions that may be made in all."""
        sequence = self._problem.spec.sequence
        if self._until is None or self._until.duration is None:
            return most_motions(sequence)
        fitting = self._until.duration / self._problem.trajectory.duration * (1.0 + _ROUNDING)
        return min(int(fitting), most_motions(sequence))

    def reached(self, result: Result) -> bool:
        """Whether the data of `result` are as precise as asked; false where nothing is asked."""
        if not self._precise or not _shows_all(result.stack):
            return False
        return self.enough(invariants(self._problem, result.stack, self._design))

    def enough(self, found: Invariants) -> bool:
        """Whether the figures `found` are as precise as asked; true where nothing is asked."""
        if self._until is None:
            return True
        most, least = self._until.torque_deviation, self._until.efficiency
        if most is not None and not found.torque_deviation <= most:
            return False
        return least is None or (found.efficiency is not None and found.efficiency >= least)

    @property
    def _precise(self) -> bool:
        return self._until is not None and self._until.precise

    @cached_property
    def _design(self) -> FreeDesign | None:
        asked = self._until is not None and self._until.efficiency is not None
        return design_for(self._problem) if asked else None


def _shows_all(stack: Stack) -> bool:
    return stack.rows > 0 and bool(np.linalg.cond(stack.factor) < _SINGULAR)
