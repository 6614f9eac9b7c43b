"""The model of a diagnosis for a simulator that has not all of its effects.

What a simulator lacks is left out, and the rest fitted again to the same data: with R the factor
of their information, x̂ the estimate and R_k the columns of what is kept,

    minimise  ‖R_k y − R x̂‖²    over bodies that can be, friction and armature ≥ 0,

near the URDF where the data show nothing (`consistent_near_prior`). Viscous and Coulomb friction
join on joints that lose an effect, if the diagnosis tested them. Effects of single recordings and
defects of the data stay free and go into no file.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import body_lengths, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EVERYDAY_FRICTION
from excite_cli.identification.consistent import consistent_near_prior
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.fit import effect_parameters
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot

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

    def held_by(self, holds: Holds, values: Array) -> bool:
        """Whether a simulator has it, its signs as physics wants them."""
        signs = [each.nonnegative for each in self.effect.parameters]
        return self.free or holds(self.effect, np.where(signs, np.abs(values), values))


def reduced_model(found: Diagnosis, robot: Robot, holds: Holds) -> ReducedModel | None:
    """The model with the effects that a simulator `holds`; None if there is no such."""
    base = find_base_parameters(robot)
    columns = _columns(found, robot, base.rank)
    whole = [column for column in columns if column.chosen]
    known = np.concatenate([base.mapping @ found.phi, *(each.values for each in whole)])
    right = found.information.factor[:, : len(known)] @ known
    kept = [each for each in whole if each.held_by(holds, each.values)]
    while True:
        kept += _straight(columns, kept, whole)
        reduced = _fitted(found, robot, base, kept, right)
        if reduced is None:
            return None
        values = {id(c): x for c, (_, x) in zip(kept, reduced.model.by_effect, strict=True)}
        left = [each for each in kept if each.held_by(holds, values[id(each)])]
        if len(left) == len(kept):
            gone = tuple(each.effect for each in whole if each not in kept)
            return replace(reduced, dropped=gone)
        kept = left


def _columns(found: Diagnosis, robot: Robot, rank: int) -> list[_Column]:
    """All effects of the information, those of the model with the values that are told."""
    told = {
        _key(record): np.asarray(record.values, dtype=float)
        for record in (*found.declared, *(named.effect for named in found.effects))
    }
    information, columns, start = found.information, [], rank
    for record in (*information.model, *information.rivals, *information.possible):
        size = len(record.values)
        chosen = start < rank + sum(len(each.values) for each in information.model)
        values = told.get(_key(record), np.asarray(record.values, dtype=float))
        effect = effect_of(record, robot.joint_names)
        columns.append(_Column(effect, values, range(start, start + size), chosen))
        start += size
    return columns


def _key(record: EffectRecord) -> tuple[object, ...]:
    return record.kind, record.joints, record.runs, record.covariate


def _straight(columns: list[_Column], kept: list[_Column], whole: list[_Column]) -> list[_Column]:
    """Viscous and Coulomb friction that was tested, on joints that lose an effect."""
    joints = {joint for each in whole if each not in kept for joint in each.effect.joints}
    there = {each.effect.place for each in whole}
    return [
        each
        for each in columns
        if each.effect.kind in EVERYDAY_FRICTION
        and joints.issuperset(each.effect.joints)
        and not (each.effect.runs or each.effect.place in there or each in kept)
    ]


def _fitted(
    found: Diagnosis, robot: Robot, base: BaseParameters, kept: list[_Column], right: Array
) -> ReducedModel | None:
    effects = tuple(each.effect for each in kept)
    at = [*range(base.rank), *(column for each in kept for column in each.at)]
    stacked = np.column_stack([found.information.factor[:, at], right])
    rows = triangle_of(np.pad(stacked, ((0, 1), (0, 0))))
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
