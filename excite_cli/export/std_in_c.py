"""The standard deviation of the predicted torque, `excite_std` of a model's C file.

It is that of `Validity.deviation`. With columns Y = Y_B G of the inertias (G maps φ to r base
parameters) and E of the k effects, d = |[Y E] B| is

    d² = |R x|²,    x = [Y_B E],    RᵀR = A Aᵀ,    A = [G B_φ; B_θ],

R upper triangular (r + k, r + k).
"""

from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.mechanism import real
from excite_cli.export.c_text import braced, filled, wrapped
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import Series, places_of
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import tree_of
from excite_cli.scoring.validity import CURVE, Trust

TEST_COLUMN = ", TEST_COLUMN + at * EXCITE_COLUMNS"
_LEAST = 1e-30  # of what is divided by: a joint that never moved


def std_in_c(
    robot: Robot, model: IdentifiedModel, kept: IdentifiedModel, trust: Trust, tested: Series
) -> str:
    """Its code, with a test over the states `tested`.

    `model` is the one of `trust`, `kept` it without effects of single recordings.
    """
    text = (files("excite_cli.export") / "std_template.c").read_text(encoding="utf-8")
    own = trust.validity
    ranges = np.maximum(np.stack([own.speed, own.load], axis=1), _LEAST)
    rows = np.hstack([own.coefficients, own.standing[:, None], ranges, own.line])
    unknown = np.isnan(rows).any(axis=1)
    rows[unknown] = np.array([-1.0, *[0.0] * 4, 1.0, 1.0, *[0.0] * own.line.shape[1]])
    selected, codes, root = _parameters(robot, model, trust)
    gaps = {
        "OWN": braced(rows),
        "MOVING": real(own.moving),
        "SMEAR": real(own.smear),
        "CURVE": real(CURVE),
        "COLUMN": ", const real column[EXCITE_COLUMNS]" if tested.covariates else "",
        "GIVEN": ", column" if tested.covariates else "",
        "TEST_COLUMN": TEST_COLUMN if tested.covariates else "",
        "TEST_ROW": ", TEST_COLUMN" if tested.covariates else "",
        "ZERO": "" if len(root) else " (here 0: their covariance is not known)",
        "UNSURE": str(len(root)),
        "INERTIAL": str(len(selected)),
        "SELECTED": ", ".join(map(str, [*selected, 0])),
        "ROOT": wrapped(root.T[np.tril_indices(len(root))]),
        "WHOLE": str(int(any(effect.data_defect for effect in model.effects))),
        "EFFECT_COLUMNS": "\n".join(
            f"    {{ real *tau = x[{len(selected) + k}]; {code} }}" for k, code in enumerate(codes)
        ),
        "TEST_STD": wrapped(np.where(unknown, 0.0, _tested(robot, kept, trust, tested))),
    }
    return filled(text, gaps)


def _parameters(
    robot: Robot, model: IdentifiedModel, trust: Trust
) -> tuple[NDArray[np.intp], list[str], Array]:
    """Columns of Y (in the order of the tree's bodies), code of all others, and R.

    Of effects of single recordings none: they add nothing to a state.
    """
    if trust.root is None:
        return np.zeros(0, dtype=np.intp), [], np.zeros((0, 0))
    base, count = find_base_parameters(robot), len(model.phi)
    selection, mapped = base.selection, base.mapping @ trust.root[:count]
    if base.tilted:  # their G is that of right angles
        selection, mapped = np.arange(count), trust.root[:count]
    before = 10 * tree_of(robot).first_body  # of the base, which stands still
    selection, mapped = selection[selection >= before], mapped[selection >= before]
    # Of the last bodies first: they show in most joints, and the first columns of R are short.
    columns, rows, codes, others = [selection[::-1]], [mapped[::-1]], [], []
    places = places_of(model.effects, len(trust.root))
    for effect, place in zip(model.effects, places, strict=True):
        own = trust.root[place]
        if effect.runs:
            continue
        if effect.carried:
            first = 10 * (robot.model_joints[effect.joints[-1]] - 1)
            columns.append(np.arange(first, first + 10))
            rows.append(own)
            continue
        found = [effect.in_c(unit, ()) for unit in np.eye(len(own))]
        codes += found if all(found) else []
        others += [own] if all(found) else []
    root = triangle_of(np.vstack([*rows, *others]).T)
    return np.concatenate(columns) - before, codes, root


def _tested(robot: Robot, kept: IdentifiedModel, trust: Trust, tested: Series) -> Array:
    """s (T, n) of each state by itself."""
    found = []
    for k in range(len(tested.t)):
        q, v, a = (x[k : k + 1] for x in (tested.q, tested.v, tested.a))
        columns = {name: values[k : k + 1] for name, values in tested.covariates.items()}
        state = Series(np.zeros(1), q, v, a, covariates=columns)
        found.append(trust.deviation(state, kept.predicted(robot, state))[0])
    return np.array(found)
