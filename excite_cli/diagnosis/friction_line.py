"""First-order friction beside its refinement, as people know it.

With f_v v + f_c sgn v + c sgn v·|v|^p in a model (or a part that grows with the load), f_v and f_c
are what is left once that term has taken its part: for a concave curve even negative. What data
sheets and other fits call viscous and Coulomb friction is the straight line through all of it. So
with the line α v + β sgn v nearest to the curve over the speeds in the data, f_v + c α and
f_c + c β are reported, and the curved term stands for the deviation from the line.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.tracing import Traced
from excite_cli.robot.model import Array

_STRAIGHT = ("viscous_friction", "coulomb_friction")
_CURVED = ("nonlinear_viscous_friction", "stribeck_friction", "load_dependent_friction")


def friction_lines(traced: Traced, start: int) -> Array:
    """T (k, k): parameters as reported = T @ parameters as fitted; effects begin at `start`."""
    starts, at = {}, start
    for i in traced.chosen:
        starts[i] = at
        at += traced.candidates[i].width
    transform = np.eye(at)
    for i in traced.chosen:
        effect = traced.candidates[i].effect
        if effect.kind not in _CURVED:
            continue
        lines = [
            _find(traced, kind, effect.joints) for kind in ("viscous_friction", "coulomb_friction")
        ]
        present = [k for k in lines if k is not None]
        if not present:
            continue
        slope = _line(traced, i, present)
        for k, value in zip(present, slope, strict=True):
            transform[starts[k], starts[i]] = value
    return transform


def _find(traced: Traced, kind: str, joints: Sequence[int]) -> int | None:
    for i in traced.chosen:
        effect = traced.candidates[i].effect
        if effect.kind == kind and tuple(effect.joints) == tuple(joints):
            return i
    return None


def _line(traced: Traced, curved: int, present: Sequence[int]) -> Array:
    """Coefficients of the line nearest to the curve over the training data."""
    columns = np.concatenate(
        [
            np.concatenate([traced.candidates[k].columns[part][:, 0] for k in present], axis=1)
            for part in range(len(traced.data.runs))
        ]
    )
    curve = np.concatenate(
        [traced.candidates[curved].columns[part][:, 0, 0] for part in range(len(traced.data.runs))]
    )
    return np.asarray(np.linalg.lstsq(columns, curve, rcond=1e-9)[0])
