"""Effects that would show as other values of inertial parameters only, and of which."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.records import Absorbed
from excite_cli.diagnosis.schur import ABSORBED
from excite_cli.effects.place import Place

_NAMED = 4
_WORTH_NAMING = 0.15


def absorbed_effects(
    evidence: Evidence, candidates: Sequence[Candidate], chosen: Sequence[int], model: Model
) -> tuple[Absorbed, ...]:
    """Candidates of which the model leaves less than 0.1 % of their energy, and scales tell none.

    The model is the declared one with the chosen effects, which are named by their own parameters.
    What does not show in these data at all is not absorbed by anything. Only the first parameter
    counts (where a stiffness is absorbed, so is its effect, though the preload may show as an
    offset).
    """
    if model.vague:
        evidence = evidence.without_prior
    at, joint_names = evidence.columns(chosen), model.robot.joint_names
    factor, schur = evidence.factor(chosen), evidence.schur(chosen)
    found: dict[Place, Absorbed] = {}
    effects = [candidates[i].effect for i in chosen]
    taken = {effect.place for effect in effects}
    names = [model.base.names[k] for k in model.base.selection]
    for effect in (*model.declared, *effects):
        where = "+".join(joint_names[j] for j in effect.joints)
        names += [f"{parameter.name}[{where}]" for parameter in effect.parameters]
    for i, c in enumerate(candidates):
        if c.place in taken or c.place in found or c.effect.runs or c.effect.refines:
            continue
        main = evidence.blocks[i][0]
        own = float(evidence.total[main, main])
        if own <= 0.0 or schur.told_by_weight(i):
            continue
        columns = evidence.blocks[i] - evidence.fixed
        rest = schur.block(columns, columns)
        left = rest[0, 0] - rest[0, 1:] @ np.linalg.lstsq(rest[1:, 1:], rest[1:, 0], rcond=1e-9)[0]
        if left > ABSORBED * own:
            continue
        weight = np.abs(factor.solve(evidence.total[at, main]))
        order = np.argsort(-weight)
        by = [names[k] for k in order[:_NAMED] if weight[k] > _WORTH_NAMING * weight.max()]
        joints = tuple(joint_names[j] for j in c.effect.joints)
        found[c.place] = Absorbed(c.effect.kind, joints, tuple(by), float(max(left, 0.0) / own))
    return tuple(found.values())
