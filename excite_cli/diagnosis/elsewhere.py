"""What every robot has stays where it matters to other motions, if the data are sure of it.

Friction and the inertia of rotors leave a model where data left out do not miss them. Of a joint
that crept these data miss nothing: a rotor of 2.9 ± 0.1 kg·m², next to nothing there, is 0.9 of all
torque seen at the joint's range and speed. So what is beyond two standard deviations and
a fiftieth of the torque along a usual motion is taken in again. Not so defects of the measurement,
of which many robots have none: with offsets a UR10 of the battery was left with 14.8 % for 7.4.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.reach import torque_seen
from excite_cli.diagnosis.search import weakest_apart
from excite_cli.diagnosis.textbook import everyday
from excite_cli.diagnosis.tracing import Traced

_MATTERS = 0.02  # of the joint's torque
_ITS_OWN = 1e-6  # of a column's energy: what the model leaves of less is rounding
_DEVIATIONS = 2.0


def needed_elsewhere(traced: Traced, chosen: Sequence[int]) -> list[int]:
    """The textbook's candidates that are not chosen, are surely there and matter elsewhere.

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
        sd = np.sqrt(traced.inflation * np.diag(white.covariance(every, last)))
        leaving = {}
        for i, size, own_sd in zip(found, np.abs(theta[-len(found) :]), sd, strict=True):
            (joint,) = candidates[i].rows
            most = size * np.sqrt(traced.usual.squares(candidates[i].effect).item())
            sure, matters = size > _DEVIATIONS * own_sd, most > _MATTERS * torque[joint]
            if not (sure and matters and judge.allowed(theta, every, [i])):
                leaving[i] = float(size / max(own_sd, 1e-300))
        if not leaving:
            break
        gone = weakest_apart(leaving, lambda i: candidates[i].rows)
        found = [i for i in found if i not in gone]
    return found
