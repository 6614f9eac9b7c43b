"""The problem of telling apart what a diagnosis could not: its pairs on the data's columns."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from excite_cli.criteria.sigma_min import SigmaMin
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.effects.base import Effect
from excite_cli.errors import FileError
from excite_cli.excitation.discrimination import Direction, Separation, divergences
from excite_cli.excitation.effect_columns import column_names, extend, in_words, why_not_planned
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, on_fine_grid
from excite_cli.robot.model import Array, Robot

# Width of the sign of a speed on the fine grid of a separation [rad/s].
_FINE_SIGN = 0.005
# Pairs of which random motions leave less than this share are the same torque.
_SAME_TORQUE = 1e-8


class DataColumns:
    """Where every effect stands in the data's factor, by its kind, joints and shape."""

    def __init__(self, diagnosis: Diagnosis, robot: Robot, rank: int) -> None:
        information = diagnosis.information
        self.robot, self.rank = robot, rank
        self.triangle = np.asarray(information.factor, dtype=float)
        self.at: dict[tuple[str, ...], NDArray[np.intp]] = {}
        self.rivals: list[Effect] = []
        self.possible: list[Effect] = []
        self.values: dict[tuple[str, ...], Array] = {}
        first = self.rank
        rivals = len(information.model), len(information.model) + len(information.rivals)
        for number, record in enumerate(
            (*information.model, *information.rivals, *information.possible)
        ):
            effect = effect_of(record, robot.joint_names)
            count = len(effect.parameters)
            self.at[_key(effect, robot)] = np.arange(first, first + count)
            self.values[_key(effect, robot)] = np.asarray(record.values, dtype=float)
            if number >= rivals[1]:
                self.possible.append(effect)
            elif number >= rivals[0]:
                self.rivals.append(effect)
            first += count
        if self.triangle.ndim != 2 or self.triangle.shape[1] != first:
            raise FileError(
                f"--after: the diagnosis holds data on {self.triangle.shape[-1]} columns, but its "
                f"robot and effects have {first}. Make it anew with this version."
            )

    def factor(self, problem: Problem) -> Stack:
        """The data as a stack on the columns of `problem`, in its scales."""
        chosen = [np.arange(self.rank)]
        chosen += [self.at[_key(effect, self.robot)] for effect in problem.extension.effects]
        rows = self.triangle[:, np.concatenate(chosen)] * problem.column_scales
        size = rows.shape[1]
        padded = np.vstack([rows, np.zeros((size, size))])
        return Stack(np.ascontiguousarray(qr(padded, mode="r")[0][:size]), len(rows))


def separated(
    problem: Problem, columns: DataColumns, pairs: Sequence[tuple[EffectRecord, EffectRecord]]
) -> tuple[Problem | None, list[str]]:
    """The problem of separating those `pairs` that a motion can separate, and what was left out."""
    robot, said = problem.robot, []
    wanted: list[tuple[Effect, Effect]] = []
    for named, alias in pairs:
        both = effect_of(named, robot.joint_names), effect_of(alias, robot.joint_names)
        reason = _why_not_separated(both, problem, columns)
        if reason:
            said.append(f"{in_words(both[0], robot)} / {in_words(both[1], robot)}: {reason}")
        else:
            wanted.append(both)
    rivals = [e for e in columns.rivals if any(e == alias for _, alias in wanted)]
    extension = extend(
        robot,
        problem.base,
        problem.weighting,
        [*problem.extension.effects, *rivals],
        problem.trajectory.duration,
        absorbed_too=True,
    )
    wide = replace(problem, extension=replace(extension, width=_FINE_SIGN), criterion=SigmaMin())
    wide = wide if problem.extension.fine else on_fine_grid(wide)
    objective = wide.objective()
    states = robot.draw_states(400, 3)
    block = objective.block_of(np.linspace(0.0, wide.trajectory.duration, 400), *states)
    random, directions = block.T @ block, []
    for first, second in wanted:
        both_ways = [
            _direction(first, second, wide, columns),
            _direction(second, first, wide, columns),
        ]
        left = [
            2.0 * float(divergences(random, [d])[0]) / float(d.truth @ random @ d.truth)
            for d in both_ways
        ]
        if min(left) < _SAME_TORQUE:
            said.append(
                f"{in_words(first, robot)} / {in_words(second, robot)}: the same torque in other "
                "words, no motion separates them"
            )
        else:
            directions += both_ways
    if not directions:
        return None, said
    separation = Separation(tuple(directions), columns.factor(wide))
    return replace(wide, separation=separation), said


def _why_not_separated(both: tuple[Effect, Effect], problem: Problem, columns: DataColumns) -> str:
    """Why no motion is planned for this pair; empty if one is."""
    robot = problem.robot
    for effect in both:
        reason = why_not_planned(effect, robot)
        if reason:
            return reason
        values = columns.values.get(_key(effect, robot))
        if values is None or len(values) != len(effect.parameters) or not values.any():
            return "the diagnosis holds no value of one of them"
    if both[0] not in problem.extension.effects:
        return "the regressor of the model shows it already"
    return ""


def _direction(truth: Effect, other: Effect, wide: Problem, columns: DataColumns) -> Direction:
    """`truth` with its values, explained by base parameters, the model's effects and `other`."""
    rank, names, robot = wide.base.rank, wide.extension.names, wide.robot
    at = {name: rank + index for index, name in enumerate(names)}
    own = [at[name] for name in column_names(truth, robot)]
    rivals = {
        name
        for rival in columns.rivals
        if rival != other
        for name in column_names(rival, robot)
        if name not in column_names(other, robot)
    }
    vector = np.zeros(wide.columns)
    vector[own] = columns.values[_key(truth, robot)] / wide.column_scales[own]
    free = [
        i
        for i in range(wide.columns)
        if i not in own and (i < rank or names[i - rank] not in rivals)
    ]
    pair = in_words(truth, robot), in_words(other, robot)
    return Direction(pair, vector, np.array(free, dtype=np.intp))


def _key(effect: Effect, robot: Robot) -> tuple[str, ...]:
    return (*column_names(effect, robot), *effect.runs)
