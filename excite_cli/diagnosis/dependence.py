"""On what the rest depends, as a map: joints by quantities, shares of the residual's energy.

A share is what smooth functions of one quantity take off the residual of the fit, but no more than
they take off the error on runs left out: of noise every function explains something where it is
fitted and nothing where it is not; and on runs left out a function may also repair what an
ill-conditioned fit has spoiled there.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.evidence import Evidence
from excite_cli.robot.model import Array


def confirmed_shares(plain: Evidence, chosen: Sequence[int], joint: int) -> Array:
    """Shares (K,) for the candidates of `plain` beyond the `chosen` ones, which come first."""
    others = range(len(chosen), len(plain.blocks))
    shares = []
    for blocks in (plain.by_fold, plain.seen):
        before = float(blocks.energies(chosen, [joint]).sum())
        after = blocks.with_each(chosen, others, [joint])
        # What grows explains nothing, by however much: of nearly nothing, more than numbers hold.
        shares.append([min(after[i].sum(), before) / max(before, 1e-300) for i in others])
    return np.clip(1.0 - np.max(shares, axis=0), 0.0, 1.0)
