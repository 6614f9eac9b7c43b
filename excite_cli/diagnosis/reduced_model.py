"""The model of a diagnosis for a simulator that has not all of its effects.

What a simulator lacks is left out, and the rest makes up for it as far as it may: with R the factor
of the data's information, x̂ the estimate, R_k the columns of what is kept, and M the factor of what
the whole model knows of the parameters p that a simulator has by their names,

    minimise  ‖M (y_p − x̂_p)‖² + ‖R_k y − R x̂‖² / s²    over bodies that can be, friction ≥ 0,

near the URDF where the data show nothing (`consistent_near_prior`). The second term alone is the
fit without the lost effects; it is off by far more than noise, and takes what is lost for inertias.
Straight friction of joints that lose an effect is not among p; where the model has none, viscous
and Coulomb friction join if they were tested. Effects of single recordings and defects of the data
stay in the fit, and go into no file.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import body_lengths, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EVERYDAY_FRICTION
from excite_cli.errors import FileError
from excite_cli.identification.consistent import consistent_near_prior
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.fit import effect_parameters
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot

# What is lost misfits by so many times the noise. RMS deviations of a replay [mrad] of TX40, UR10,
# Med 7, Go2 with 1, 3, 10: 4.8, 7.8, 10.8, 4.0; 4.8, 7.6, 9.9, 4.1; 4.8, 7.5, 9.8, 4.3. Without the
# first term 4.9, 8.0, 11.1, 4.0, and a rotor of the UR10 falls from 1.7 to 0.02 kg·m².
_MISFIT = 3.0

Holds = Callable[[Effect, Array], bool]


@dataclass(frozen=True)
class ReducedModel:
    """`model` with bodies that can be; `estimate`, the same of the data alone; what was `dropped`.

    `factor` (r + k, r + k) of their information, of base parameters and the model's effects.
    """

    model: IdentifiedModel
    estimate: IdentifiedModel
    factor: Array
    dropped: tuple[Effect, ...]


@dataclass(frozen=True, eq=False)
class _Column:
    """An effect of the diagnosis, and where its columns stand in the factor."""

    effect: Effect
    values: Array
    at: range
    chosen: bool

    @property
    def free(self) -> bool:
        """Whether it is fitted, whatever a simulator has."""
        return bool(self.effect.runs) or self.effect.carried or self.effect.data_defect

    def straight_on(self, joints: set[int]) -> bool:
        """Whether it is viscous or Coulomb friction of one of `joints`, in all runs."""
        effect = self.effect
        return (
            effect.kind in EVERYDAY_FRICTION
            and not effect.runs
            and joints.issuperset(effect.joints)
        )

    def held_by(self, holds: Holds, values: Array) -> bool:
        """Whether a simulator has it, its signs as physics wants them."""
        signs = [each.nonnegative for each in self.effect.parameters]
        return self.free or holds(self.effect, np.where(signs, np.abs(values), values))


def reduced_model(
    found: Diagnosis, robot: Robot, holds: Holds, where: object = "the diagnosis"
) -> ReducedModel | None:
    """The model with the effects that a simulator `holds`; None if there is no such.

    `where` it was read from is what an error names.

    Raises
    ------
    FileError
        What the diagnosis knows of its model is of other effects, or of another robot.
    """
    base = find_base_parameters(robot)
    _require_own(found, base.rank, where)
    columns = _columns(found, robot, base.rank)
    whole = [column for column in columns if column.chosen]
    kept = [each for each in whole if each.held_by(holds, each.values)]
    joined: list[_Column] = []
    while True:
        more = [each for each in _joining(columns, kept, whole) if each not in joined]
        joined += more
        kept = [*kept, *more]
        reduced = _fitted(found, robot, base, kept, whole)
        if reduced is None:
            return None
        values = {id(c): x for c, (_, x) in zip(kept, reduced.model.by_effect, strict=True)}
        left = [each for each in kept if each.held_by(holds, values[id(each)])]
        if len(left) == len(kept):
            gone = tuple(each.effect for each in whole if each not in kept)
            return replace(reduced, dropped=gone)
        kept = left


def _require_own(found: Diagnosis, rank: int, where: object) -> None:
    """Raise FileError unless the information is that of the model."""
    information = found.information
    told = {r.key for r in (*found.declared, *(named.effect for named in found.effects))}
    records = (*information.model, *information.rivals, *information.possible)
    size = rank + sum(len(record.values) for record in records)
    same = told == {record.key for record in information.model}
    if not (same and information.rank == rank and information.factor.shape[1] == size):
        raise FileError(
            f"{where}: its covariance is of other effects than its model. Diagnose again."
        )


def _columns(found: Diagnosis, robot: Robot, rank: int) -> list[_Column]:
    """All effects of the information, those of the model with the values that are told."""
    told = {
        record.key: np.asarray(record.values, dtype=float)
        for record in (*found.declared, *(named.effect for named in found.effects))
    }
    information, columns, start = found.information, [], rank
    for record in (*information.model, *information.rivals, *information.possible):
        size = len(record.values)
        chosen = start < rank + sum(len(each.values) for each in information.model)
        values = told.get(record.key, np.asarray(record.values, dtype=float))
        effect = effect_of(record, robot.joint_names)
        columns.append(_Column(effect, values, range(start, start + size), chosen))
        start += size
    return columns


def _joining(columns: list[_Column], kept: list[_Column], whole: list[_Column]) -> list[_Column]:
    """Viscous and Coulomb friction that was tested, on joints that lose an effect."""
    joints, there = _losing(kept, whole), {each.effect.place for each in (*whole, *kept)}
    return [e for e in columns if e.straight_on(joints) and e.effect.place not in there]


def _fitted(
    found: Diagnosis,
    robot: Robot,
    base: BaseParameters,
    kept: list[_Column],
    whole: list[_Column],
) -> ReducedModel | None:
    effects = tuple(each.effect for each in kept)
    rows = triangle_of(np.pad(_rows(found, base, kept, whole), ((0, 1), (0, 0))))
    cad = standard_parameters(robot)
    signs = np.array([p.nonnegative for p in effect_parameters(effects)], bool)
    prior = inertial_prior(robot, cad, 1.0)
    nearest = consistent_near_prior(rows, base, prior, body_lengths(robot, cad), signs)
    if not nearest.solved:
        return None
    factor = rows[:-1, :-1]
    free = np.asarray(np.linalg.lstsq(factor, rows[:-1, -1], rcond=None)[0], dtype=float)
    phi = np.array(found.phi)
    phi[base.selection] += free[: base.rank] - base.mapping @ phi
    return ReducedModel(
        IdentifiedModel(nearest.phi, effects, nearest.effects),
        IdentifiedModel(phi, effects, free[base.rank :]),
        factor,
        (),
    )


def _rows(
    found: Diagnosis, base: BaseParameters, kept: list[_Column], whole: list[_Column]
) -> Array:
    """[A z] of the least squares ‖A y − z‖²; those of the data alone where nothing is lost."""
    factor, bodies = found.information.factor, range(base.rank)
    known = np.concatenate([base.mapping @ found.phi, *(each.values for each in whole)])
    at = [*bodies, *(k for each in kept for k in each.at)]
    data = np.column_stack([factor[:, at], factor[:, : len(known)] @ known])
    joints = _losing(kept, whole)
    own = [
        *bodies,
        *(k for each in kept if each in whole and not each.straight_on(joints) for k in each.at),
    ]
    others = [k for k in range(len(known)) if k not in set(own)]
    turned = triangle_of(factor[:, [*others, *own]])
    named = turned[len(others) :, len(others) :]
    rows = np.zeros((len(named), len(at) + 1))
    rows[:, [at.index(k) for k in own]], rows[:, -1] = named, named @ known[own]
    return np.vstack([rows, data / _MISFIT]) / np.hypot(1.0, 1.0 / _MISFIT)


def _losing(kept: list[_Column], whole: list[_Column]) -> set[int]:
    """Joints that lose an effect."""
    return {joint for each in whole if each not in kept for joint in each.effect.joints}
