"""How many of the effects are worth their complexity: the error against their number.

Effects join in the order in which the rounds of the diagnosis took them. Chosen is by training runs
left out of the fit, never by the sealed one: the best number is that of the least error there, and
the smallest model is the first within one standard error of it (Breiman et al. 1984), the standard
deviation over the runs left out divided by the root of their number.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.records import ErrorPath
from excite_cli.diagnosis.sealed_errors import INERTIAS, SealedErrors
from excite_cli.diagnosis.tracing import Traced
from excite_cli.robot.model import Array

_FEWEST = 3  # runs left out, of which a standard error says something


def error_path(traced: Traced, order: Sequence[int], sealed: SealedErrors) -> ErrorPath | None:
    """The error with none, one, two … of the candidates in `order`; None if there are none."""
    if not order:
        return None
    steps = [tuple(order[:count]) for count in range(len(order) + 1)]
    left_out = _left_out(traced, steps)  # (steps, folds)
    mean = left_out.mean(axis=1)
    best = int(np.argmin(mean))
    folds = left_out.shape[1]
    error = float(left_out[best].std(ddof=1) / np.sqrt(folds)) if folds > 1 else 0.0
    smallest = int(np.flatnonzero(mean <= mean[best] + error)[0])
    kept = (INERTIAS,) if INERTIAS in sealed.who else ()
    on_sealed = [float(np.nanmean(sealed.of((*kept, *sorted(step))))) for step in steps]
    return ErrorPath(
        tuple(map(float, mean)), tuple(on_sealed), error, best, smallest, folds >= _FEWEST
    )


def _left_out(traced: Traced, steps: Sequence[tuple[int, ...]]) -> Array:
    """Share (steps, runs left out) of the declared model's RMS that remains, mean over joints."""
    plain = traced.judge.plain
    joints = [j for j in range(traced.data.n) if plain.left_out((), [j]).all()]
    first = np.stack([plain.left_out((), [j]) for j in joints])
    return np.array([
        np.sqrt(np.stack([plain.left_out(step, [j]) for j in joints]) / first).mean(axis=0)
        for step in steps
    ])  # fmt: skip
