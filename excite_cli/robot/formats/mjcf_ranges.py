"""Ranges of MJCF joints, also those that MuJoCo refuses or passes over: equal and reversed ones.

With `limited="true"` MuJoCo does not compile them, with `auto` it takes the joint for unlimited.
They are taken out before it compiles, and belong into the URDF as they are written.
"""

from math import pi
from typing import Any

_SLIDE, _HINGE = 2, 3  # mjtJoint
_UNLIMITED, _LIMITED = 0, 1  # mjtLimited
_DEGREE = pi / 180

Ranges = dict[int, tuple[float, float]]


def compiled(spec: Any) -> tuple[Any, Ranges]:
    """The model of a `mujoco.MjSpec`, and the ranges [rad or m] by the number of the joint.

    MuJoCo's own errors come through.
    """
    odd = []
    for joint in spec.joints:
        kind, says = int(joint.type), int(joint.limited)
        lower, upper = map(float, joint.range)
        given = says == _LIMITED or (says != _UNLIMITED and (lower, upper) != (0.0, 0.0))
        if kind not in (_SLIDE, _HINGE) or not given or lower < upper:
            continue
        joint.limited = _UNLIMITED
        unit = _DEGREE if kind == _HINGE and spec.compiler.degree else 1.0
        odd.append((joint, (lower * unit, upper * unit)))
    model = spec.compile()
    limited = {
        j: (float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1]))
        for j in range(model.njnt)
        if model.jnt_limited[j]
    }
    return model, {**limited, **{int(joint.id): bounds for joint, bounds in odd}}
