"""What every robot has stays unless the data say that it is next to nothing.

Friction and the inertia of rotors leave a model where data left out do not miss them. That says
nothing of other motions: on a joint that crept they may be anything. So what may be more than a
twentieth of the torque along a usual motion, by size and two standard deviations, is taken in
again. Not so defects of the measurement, of which many robots have none: with offsets a UR10 of the
battery, series of harmonics, was left with 14.8 % for 7.4.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.reach import torque_seen
from excite_cli.diagnosis.search import weakest_apart
from excite_cli.diagnosis.textbook import everyday
from excite_cli.diagnosis.tracing import Traced

# Of the joint's torque. With 0.008 the UR10 and the TX40 had four and seven effects more, and 0.0
# and 0.3 points more of error.
_MATTERS = 0.05
_ITS_OWN = 1e-6  # of a column's energy: what the model leaves of less is rounding
_DEVIATIONS = 2.0


def undecided(traced: Traced, chosen: Sequence[int]) -> list[int]:
    """The textbook's candidates that are not chosen, and of which too little is known for that.

    None that the chosen ones have among their columns, or exclude; none of an impossible size.
    """
    judge, candidates = traced.judge, traced.candidates
    taken = {candidates[i].place for i in chosen}
    taken |= {place for i in chosen for place in judge.excluded(i)}
    schur, white = judge.white.schur(chosen), judge.white
    found = []
    for i in everyday(candidates):
        (at,) = white.blocks[i]
        own = schur.diagonal[at - white.fixed] > _ITS_OWN * white.total[at, at]
        effect = candidates[i].effect
        if own and effect.place not in taken and not effect.data_defect:
            found.append(i)
    torque = np.maximum(torque_seen(traced.data), 1e-12)
    while found:
        every = [*chosen, *found]
        theta = judge.plain.solve(every)
        last = np.eye(len(theta))[:, -len(found) :]
        spread = traced.inflation * np.diag(white.covariance(every, last))
        most = np.abs(theta[-len(found) :]) + _DEVIATIONS * np.sqrt(spread)
        leaving = {}
        for i, size, sd in zip(found, most, np.sqrt(spread), strict=True):
            (joint,) = candidates[i].rows
            share = (
                size * np.sqrt(traced.usual.squares(candidates[i].effect).item()) / torque[joint]
            )
            if share < _MATTERS or not judge.allowed(theta, every, [i]):
                leaving[i] = float(size / max(sd, 1e-300))
        if not leaving:
            break
        gone = weakest_apart(leaving, lambda i: candidates[i].rows)
        found = [i for i in found if i not in gone]
    return found
