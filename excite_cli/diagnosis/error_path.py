"""How many of the effects are worth their complexity: the error against their number.

Effects join in the order in which the rounds of the diagnosis took them. Chosen is by training data
left out of the fit, never by the sealed ones: the best number is that of the least error there, and
the smallest model is the first within one standard error of it (Breiman et al. 1984), the standard
deviation over the training runs divided by the root of their number.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.records import ErrorPath, mean_of_known
from excite_cli.diagnosis.sealed_errors import INERTIAS, SealedErrors
from excite_cli.diagnosis.tracing import Traced
from excite_cli.robot.model import Array

_FEWEST = 3  # runs, of which a standard error says something


def error_path(traced: Traced, order: Sequence[int], sealed: SealedErrors) -> ErrorPath | None:
    """The error with none, one, two … of the candidates in `order`; None if there are none."""
    if not order:
        return None
    steps = [tuple(order[:count]) for count in range(len(order) + 1)]
    left_out = _left_out(traced, steps)  # (steps, folds)
    if not left_out.shape[1]:
        return None
    mean = left_out.mean(axis=1)
    best = int(np.argmin(mean))
    folds = left_out.shape[1]
    error = float(left_out[best].std(ddof=1) / np.sqrt(folds)) if folds > 1 else 0.0
    smallest = int(np.flatnonzero(mean <= mean[best] + error)[0])
    kept = (INERTIAS,) if INERTIAS in sealed.who else ()
    on_sealed = [mean_of_known(sealed.of((*kept, *sorted(step)))) for step in steps]
    return ErrorPath(
        tuple(map(float, mean)), tuple(on_sealed), error, best, smallest, folds >= _FEWEST
    )


def _left_out(traced: Traced, steps: Sequence[tuple[int, ...]]) -> Array:
    """Share (steps, runs) of the declared model's RMS that remains of blocks left out in turn.

    Mean over the joints of which a run says something; runs that say nothing are left away.
    """
    blocks, n = traced.judge.plain.in_turn, traced.data.n
    energies = np.array([blocks.energies(s).reshape(n, -1, 2).sum(axis=2) for s in steps])
    first = energies[0]  # (joints, folds)
    seen = first > 0.0
    shares = np.sqrt(np.where(seen, energies / np.where(seen, first, 1.0), 0.0)).sum(axis=1)
    known = seen.any(axis=0)
    return np.asarray(shares[:, known] / seen.sum(axis=0)[known])
