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
    before = float(plain.left_out(chosen, [joint]).sum())
    after = np.array(
        [plain.left_out([*chosen, i], [joint]).sum() for i in range(len(chosen), len(plain.blocks))]
    )
    rest = plain.energy_on(chosen, [joint])
    fitted = np.array(
        [plain.energy_on([*chosen, i], [joint]) for i in range(len(chosen), len(plain.blocks))]
    )
    # What grows explains nothing, by however much: of nearly nothing, by more than numbers hold.
    left = [
        np.minimum(now, once) / max(once, 1e-300) for now, once in ((after, before), (fitted, rest))
    ]
    return np.clip(1.0 - np.maximum(*left), 0.0, 1.0)
