"""First-order friction beside its refinement: by what it is judged to be there.

With f_v v + f_c sgn v + c sgn v·|v|^p in a model (or a part that grows with load or time), both
f_v and f_c are what that term leaves: for a concave curve even negative, or nothing. Whether there
is viscous and Coulomb friction is a question of the straight line through all of it: with the line
α v + β sgn v nearest to the curve over the speeds in the data, of f_v + c α and f_c + c β.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.tracing import Traced
from excite_cli.robot.model import Array


def friction_lines(traced: Traced, start: int) -> Array:
    """T (k, k): parameters as judged = T @ parameters as fitted; effects begin at `start`."""
    starts, at = {}, start
    for i in traced.chosen:
        starts[i] = at
        at += traced.candidates[i].width
    transform = np.eye(at)
    for i in traced.chosen:
        effect = traced.candidates[i].effect
        lines = [_find(traced, kind, effect.joints) for kind in effect.deviates_from]
        present = [k for k in lines if k is not None]
        if not present:
            continue
        slopes = _line(traced, i, present)
        for k, row in zip(present, slopes, strict=True):
            transform[starts[k], starts[i] : starts[i] + len(row)] = row
    return transform


def _find(traced: Traced, kind: str, joints: Sequence[int]) -> int | None:
    for i in traced.chosen:
        effect = traced.candidates[i].effect
        if (effect.kind, effect.joints, effect.runs) == (kind, tuple(joints), ()):
            return i
    return None


def _line(traced: Traced, curved: int, present: Sequence[int]) -> Array:
    """Coefficients (lines, columns) of the lines nearest to the curve over the training data."""

    def stacked(k: int) -> Array:
        columns = traced.candidates[k].columns
        masks = [run.usable[:, traced.candidates[k].rows[0]] for run in traced.data.runs]
        return np.concatenate([c[m, 0] for c, m in zip(columns, masks, strict=True)])

    lines = np.concatenate([stacked(k) for k in present], axis=1)
    return np.asarray(np.linalg.lstsq(lines, stacked(curved), rcond=1e-9)[0])
