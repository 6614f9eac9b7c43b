"""Structure that needs no name: how much of a residual can be predicted, and from what.

Kernel ridge regression of a joint's residual r on every quantity x_i at once, with

    k = ½ (1 + k_s) (mean of k_i + mean of k_i k_j),    k_i = exp(−|x_i − x_i'|² / 2ℓ²),

k_s that of the direction of motion: functions of one quantity and of two, in each direction their
own. Every second of the data is predicted from all others; with A = (K + λ)⁻¹ and B the samples of
one second, what the prediction leaves there is (A_BB)⁻¹ (A r)_B. Noise is forgotten within a
fraction of a second, so noise is not predicted.

From what: the same with one k_i, or one product k_i k_j, in place of all.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.linalg.blas import dsymv
from scipy.linalg.lapack import dpotrf, dpotri

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Signals
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# The history of a quantity (hysteresis), by play operators.
#
# A play operator of half-width r follows x only once x has moved r past it. x less what it shows is
# the part within the play: it runs into ±r and stays there until x turns round. Sums of such parts
# are the hystereses that do not depend on speed (Prandtl and Ishlinskii).

_WIDTHS = (0.05, 0.15, 0.4)  # of the amplitude


def histories(signals: Sequence[Array]) -> list[Array]:
    """Parts within plays of three widths, (T, n, 3) for each x (T, n); widths are common to all."""
    low = np.min([x.min(axis=0) for x in signals], axis=0)
    high = np.max([x.max(axis=0) for x in signals], axis=0)
    radii = 0.5 * (high - low)[:, None] * np.array(_WIDTHS)
    return list(each(_within_play, radii, signals))


def _within_play(radii: Array, x: Array, tell: Tell) -> Array:
    """x − play(x), (T, n, widths), from the middle of the play."""
    shown = np.empty((*x.shape, radii.shape[1]))
    now = np.repeat(x[0][:, None], radii.shape[1], axis=1)
    for k, value in enumerate(x[:, :, None]):
        now = np.minimum(np.maximum(now, value - radii), value + radii)
        shown[k] = now
    return np.asarray(x[:, :, None] - shown)


_BLOCK = 1.0  # s
_MOST_ROWS = 300  # of a joint
_WINDOW = 5.0  # s: long data are represented by stretches of this length
_FEWEST_ROWS = 60
_LENGTH = 1.5  # ℓ, in standard deviations of a quantity
_RIDGES = (1.0, 0.1, 0.01)  # λ; k is one on its diagonal
_SLOW = {"time", "run", "covariate"}
_CLEARER = 0.15  # of what one quantity leaves, a second one must explain
_DIGITS = 6  # of a share


@dataclass(frozen=True)
class Structure:
    """Shares of the residual's energy: `predictable` from everything, `named` by `depends_on`."""

    predictable: float
    named: float = 0.0
    depends_on: tuple[Covariate, ...] = ()


@dataclass(frozen=True)
class Rest:
    """Residual (k,) of a joint, the second (block) of each sample in order, and kernels (k, k).

    `direction` is ½ (1 + k_s).
    """

    joint: str
    residual: Array
    block: Indices
    direction: Array
    kernels: Mapping[Covariate, Array]

    @cached_property
    def predictable(self) -> float:
        """Share of the residual's energy that all quantities together predict."""
        every = np.array(list(self.kernels.values()))
        total, squares = every.sum(axis=0), np.square(every).sum(axis=0)
        count = len(every)
        pairs = (total**2 - squares) / (count * (count - 1))
        return self._predicted(0.5 * (total / count + pairs), _RIDGES)

    @cached_property
    def shares(self) -> dict[Covariate, float]:
        """Share of the residual's energy that each quantity alone predicts."""
        return {of: self._predicted(kernel, _RIDGES[1:]) for of, kernel in self.kernels.items()}

    def structure(self) -> Structure:
        """How much is predictable, and the quantity or the pair of them that predicts most."""
        # Of what predicts the same but for rounding (a load that is a multiple of an angle) one is
        # taken by its name, on every processor.
        single = max((round(share, _DIGITS), of.code, (of,)) for of, share in self.shares.items())
        pair = max(
            (round(self._predicted(one * other, _RIDGES[1:2]), _DIGITS), _names(a, b), (a, b))
            for (a, one), (b, other) in combinations(self._paired(), 2)
            if not {a.quantity, b.quantity} <= _SLOW  # any series is a function of both
        )
        best = pair if pair[0] - single[0] > _CLEARER * (1.0 - single[0]) else single
        return Structure(max(self.predictable, best[0], 0.0), max(best[0], 0.0), best[2])

    def _paired(self) -> list[tuple[Covariate, Array]]:
        """Accelerations of other joints are left to the functions of one quantity."""
        return [
            (covariate, kernel)
            for covariate, kernel in self.kernels.items()
            if covariate.quantity != "acceleration" or covariate.joint == self.joint
        ]

    def _predicted(self, kernel: Array, ridges: Sequence[float]) -> float:
        """The most over the `ridges`; below zero where a prediction is worse than none."""
        weighted = self.direction * kernel
        whole = max(float(self.residual @ self.residual), 1e-300)
        return 1.0 - min(self._left(weighted, ridge) for ridge in ridges) / whole

    def _left(self, kernel: Array, ridge: float) -> float:
        factor, _ = dpotrf(kernel + ridge * np.eye(len(kernel)), lower=1)
        inverse, _ = dpotri(factor, lower=1)  # its lower half
        weights = dsymv(1.0, inverse, self.residual, lower=1)
        at, there = self._seconds
        rows, columns = at[:, :, None], at[:, None]
        own = inverse[np.maximum(rows, columns), np.minimum(rows, columns)]
        blocks = np.where(there[:, :, None] & there[:, None], own, np.eye(at.shape[1]))
        errors = np.linalg.solve(blocks, np.where(there, weights[at], 0.0)[:, :, None])
        return float(np.sum(errors**2))

    @cached_property
    def _seconds(self) -> tuple[Indices, Mask]:
        """Samples (B, w) of every second, those of fewer than w filled up; which ones are there."""
        starts, counts = np.unique(self.block, return_index=True, return_counts=True)[1:]
        order = np.arange(counts.max())
        there = order < counts[:, None]
        return starts[:, None] + np.where(there, order, 0), there


def _names(a: Covariate, b: Covariate) -> list[str]:
    return sorted((a.code, b.code))


class Quantities:
    """What a residual may be a function of: series (M, n, w) per part, averaged as errors are."""

    def __init__(
        self, data: TrainingData, signals: Sequence[Signals], joint_names: Sequence[str]
    ) -> None:
        self._data, self._names = data, joint_names
        self._base = data.runs[0].base_rows  # known hardly beyond its noise

        def averaged(series: Sequence[Array]) -> list[Array]:
            return [run.averaged(x) for run, x in zip(data.runs, series, strict=True)]

        self._q, self._v, self._a, self._load = (
            averaged([getattr(s, name) for s in signals]) for name in ("q", "v", "a", "load")
        )
        self._past_q = averaged(histories([s.q for s in signals]))
        self._past_load = averaged(histories([s.load for s in signals]))
        self._t = averaged([s.t for s in signals])
        self._columns = {
            name: averaged([s.covariates[name] for s in signals]) for name in signals[0].covariates
        }

    @property
    def names(self) -> tuple[Covariate, ...]:
        """What a residual is tried against; what is a joint's own has one name for all joints."""
        return tuple(covariate.common for covariate, _ in self._all(0))

    def rest(self, joint: int, residuals: Sequence[Array]) -> Rest | None:
        """The residual of a joint and its kernels; None where too few samples are known.

        residuals: (M, n) per part.
        """
        rows, block = self._rows(joint)
        if sum(len(each) for each in rows) < _FEWEST_ROWS:
            return None

        def taken(series: Sequence[Array]) -> Array:
            return np.concatenate([x[at] for x, at in zip(series, rows, strict=True)])

        direction = _kernel(taken([np.sign(v[:, joint, None]) for v in self._v]))
        return Rest(
            self._names[joint],
            taken([r[:, joint] for r in residuals]),
            block,
            0.5 * (1.0 + direction),
            {covariate: _kernel(taken(x)) for covariate, x in self._all(joint)},
        )

    def _all(self, joint: int) -> Iterator[tuple[Covariate, list[Array]]]:
        own = self._names[joint]
        yield Covariate("time"), [t[:, None] for t in self._t]
        names = list(dict.fromkeys(run.run.name for run in self._data.runs))
        yield (
            Covariate("run"),
            [
                np.full((len(t), 1), float(names.index(run.run.name)))
                for t, run in zip(self._t, self._data.runs, strict=True)
            ],
        )
        for name, series in self._columns.items():
            yield Covariate("covariate", name), [x[:, None] for x in series]
        for k, name in enumerate(self._names[self._base :], self._base):
            yield Covariate("position", name), [x[:, k, None] for x in self._q]
            yield Covariate("speed", name), [x[:, k, None] for x in self._v]
            yield Covariate("acceleration", name), [x[:, k, None] for x in self._a]
        yield Covariate("load", own), [x[:, joint, None] for x in self._load]
        yield Covariate("position", own, True), [x[:, joint] for x in self._past_q]
        yield Covariate("load", own, True), [x[:, joint] for x in self._past_load]

    def _rows(self, joint: int) -> tuple[list[Indices], Indices]:
        """Samples of every part, and the second that each of them is in (all parts in a row).

        Of long data whole stretches are left out, evenly: neighbours in time must stay.
        """
        usable = [np.flatnonzero(run.usable[:, joint]) for run in self._data.runs]
        seconds = sum(len(at) * run.step for at, run in zip(usable, self._data.runs, strict=True))
        rate = max(_MOST_ROWS / max(seconds, 1e-9), 2 * _MOST_ROWS / 60.0)
        every = max(1.0, seconds * rate / _MOST_ROWS)  # of so many windows one is taken
        rows, blocks, first, window = [], [], 0, 0
        for at, run in zip(usable, self._data.runs, strict=True):
            stride = max(1, int(np.ceil(1.0 / (run.step * rate) - 1e-9)))
            numbers = window + (at * run.step // _WINDOW).astype(int)
            chosen = np.floor((numbers + 1) / every) > np.floor(numbers / every)
            rows.append(at[chosen & (at % stride == 0)])
            seconds_in = (rows[-1] * run.step // _BLOCK).astype(np.intp)
            blocks.append(first + seconds_in)
            first += int(seconds_in.max(initial=0)) + 1
            window = int(numbers.max(initial=window)) + 1
        return rows, np.concatenate(blocks)


def _kernel(x: Array) -> Array:
    """k (k, k) of a quantity (k, w), standardised; w series count as one quantity."""
    spread = x.std(axis=0)
    unit = (x - x.mean(axis=0)) / np.where(spread > 0, spread, 1.0) / np.sqrt(x.shape[1])
    squares = np.square(unit).sum(axis=1)
    distance = np.maximum(squares[:, None] + squares - 2.0 * unit @ unit.T, 0.0)
    return np.asarray(np.exp(-0.5 * distance / _LENGTH**2))
