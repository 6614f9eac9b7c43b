"""What the training data say of the extended model and its rivals, for the next motion."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky

from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.naming import Rival
from excite_cli.diagnosis.records import EffectRecord, Information
from excite_cli.diagnosis.tracing import Traced


def information_of(model: Model, traced: Traced, rivals: Sequence[Rival]) -> Information:
    """Triangular factor of the training data's columns, whitened, for the next motion."""
    data = replace(traced.data, prior=None, weighed=None)
    unique: dict[tuple, Rival] = {}
    for alias, values in rivals:
        unique.setdefault(traced.candidates[alias.candidate].place, (alias, values))
    pool = [traced.candidates[i] for i in traced.chosen]
    pool += [traced.candidates[alias.candidate] for alias, _ in unique.values()]
    evidence = data.evidence(pool, traced.noise)
    gram = evidence.grams.total()[:-1, :-1]
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = gram / np.outer(scale, scale)
    unit[np.diag_indices(len(unit))] += 1e-12
    parameters = traced.judge.plain.solve(traced.chosen)
    at = len(parameters) - sum(c.width for c in pool[: len(traced.chosen)]) - model.declared_width
    records: list[EffectRecord] = []
    for effect in (*model.declared, *traced.effects):
        width = len(effect.parameters)
        records.append(record_of(effect, model.robot.joint_names, parameters[at : at + width]))
        at += width
    return Information(
        factor=cholesky(unit) * scale,
        rank=model.base.rank,
        model=tuple(records),
        rivals=tuple(
            record_of(traced.candidates[alias.candidate].effect, model.robot.joint_names, values)
            for alias, values in unique.values()
        ),
        noise=traced.levels,
    )
