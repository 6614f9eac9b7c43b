"""Effects that would show as other values of inertial parameters only, and of which."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.records import Absorbed
from excite_cli.diagnosis.schur import ABSORBED

_NAMED = 4
_WORTH_NAMING = 0.15


def absorbed_effects(
    evidence: Evidence,
    candidates: Sequence[Candidate],
    names: Sequence[str],
    joint_names: Sequence[str],
    chosen: Sequence[int],
) -> list[Absorbed]:
    """Candidates of which the model leaves less than 0.1 % of their energy, and scales tell none.

    The model is the declared one with the chosen effects. `names` are those of the declared model's
    columns; effects that were found are named by their own parameters. What does not show in these
    data at all is not absorbed by anything. Only the first parameter counts (where a
    stiffness is absorbed, so is its effect, though the preload may show as an offset).
    """
    at = evidence.columns(chosen)
    factor, schur = evidence.factor(chosen), evidence.schur(chosen)
    found: dict[tuple, Absorbed] = {}
    taken = {candidates[i].place for i in chosen}
    names = [*names, *_found_names([candidates[i] for i in chosen], joint_names)]
    for i, c in enumerate(candidates):
        if c.place in taken or c.place in found or c.effect.runs or c.effect.refines:
            continue
        block = evidence.blocks[i]
        main, others = block[0], block[1:]
        shared = evidence.total[at, main]
        own = float(evidence.total[main, main])
        if own <= 0.0:
            continue
        x = factor.solve(shared)
        left = own - shared @ x
        if len(others):
            cross = evidence.total[np.ix_(others, [main])][:, 0]
            mixed = evidence.total[np.ix_(at, others)]
            solved = factor.solve(mixed)
            rest = evidence.total[np.ix_(others, others)] - mixed.T @ solved
            bridge = cross - solved.T @ shared
            left -= bridge @ np.linalg.lstsq(rest, bridge, rcond=1e-9)[0]
        if left > ABSORBED * own or schur.told_by_weight(i):
            continue
        weight = np.abs(x)
        order = np.argsort(-weight)
        by = [names[k] for k in order[:_NAMED] if weight[k] > _WORTH_NAMING * weight.max()]
        joints = tuple(joint_names[j] for j in c.effect.joints)
        found[c.place] = Absorbed(c.effect.kind, joints, tuple(by), float(max(left, 0.0) / own))
    return list(found.values())


def _found_names(found: Sequence[Candidate], joint_names: Sequence[str]) -> list[str]:
    """Names of the columns of effects that were found."""
    return [
        f"{parameter.name}[{'+'.join(joint_names[j] for j in c.effect.joints)}]"
        for c in found
        for parameter in c.effect.parameters
    ]
