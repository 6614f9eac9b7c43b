"""Training data from plain random matrices, and what least squares says about them row by row.

Nothing here uses Gram matrices: rows are whitened one at a time and stacked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.sparse import identity

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.asymmetric_friction import AsymmetricFriction
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.judgement import Seen
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array

STEP = 0.02
FIXED = 4
FOLDS = (0, 1, 0, 2)
# Rows [W target] of unit variance: a prior on single parameters, and sums that were weighed.
NOTHING = np.zeros((0, FIXED + 1))
PRIOR = np.column_stack([np.diag(np.sqrt([3.0, 0.0, 50.0, 0.5])), np.zeros(FIXED)])
WEIGHED = np.array([[2.0, 2.0, 0.0, 0.0, 9.0], [0.0, 40.0, -1.0, 3.0, -5.0]])


def anything(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
    """Vetoes nothing."""
    return True


def effect(kind: str, *joints: int, **shape: float) -> Effect:
    """On joint 0 if none is named, in its first shape if none is given."""
    known = catalogue()[kind]
    return known(joints or (0,), shape or {each.name: each.low for each in known.shapes})


def usual_of_unit_columns(joints: int, fixed: int) -> Any:
    """In place of a usual motion, one along which columns are as independent and large as these."""

    def gram(model: object, effects: Sequence[Effect]) -> Array:
        width = fixed + sum(len(each.parameters) for each in effects)
        return np.tile(np.eye(width), (joints, 1, 1))

    return SimpleNamespace(gram=gram)


def prepared(
    usable: np.ndarray, q: Array | None = None, v: Array | None = None, tau: Array | None = None
) -> PreparedRun:
    """A run whose averages change nothing."""
    shape = usable.shape
    zero = np.zeros(shape)
    as_it_is = identity(shape[0], format="csr")
    return PreparedRun(
        run=RunId("run"),
        t=STEP * np.arange(shape[0]),
        q=zero if q is None else q,
        v=zero if v is None else v,
        a=zero,
        tau_raw=zero if tau is None else tau,
        averages=as_it_is,
        tau=zero if tau is None else tau,
        valid=usable,
        valid_averages=(as_it_is,) * shape[1],
        moving=np.ones(shape, bool),
        fit_averages=(as_it_is,) * shape[1],
        tau_fit=zero if tau is None else tau,
        usable=usable,
        step=STEP,
    )


def random_data(seed: int, known: Array = NOTHING, samples: int = 60) -> TrainingData:
    """Four parts of two joints in three folds, some rows not usable; `known` was weighed."""
    rng = np.random.default_rng(seed)
    usable = [rng.random((samples, 2)) > 0.03 for _ in FOLDS]
    declared = tuple(rng.normal(size=(samples, 2, FIXED)) * [1, 5, 0.1, 2] for _ in FOLDS)
    tau = tuple(rng.normal(size=(samples, 2)) + d @ rng.normal(size=FIXED) for d in declared)
    runs = tuple(prepared(u) for u in usable)
    return TrainingData(runs, FOLDS, declared, tau, known.T @ known, known.T @ known)


def random_candidates(seed: int, samples: int = 60) -> list[Candidate]:
    """One column on joint 0, one on joint 1, two on joint 0, one on both, one in part 1 only."""
    rng = np.random.default_rng([seed, 7])

    def made(effect: Effect, rows: tuple[int, ...], parts: Sequence[int]) -> Candidate:
        width = len(effect.parameters)
        columns = tuple(
            rng.normal(size=(samples, len(rows), width)) * 3.0 * (part in parts)
            for part in range(len(FOLDS))
        )
        return Candidate(effect, rows, columns)

    every = range(len(FOLDS))
    return [
        made(ViscousFriction((0,)), (0,), every),
        made(ViscousFriction((1,)), (1,), every),
        made(AsymmetricFriction((0,)), (0,), every),
        made(ViscousFriction((0, 1)), (0, 1), every),
        made(CoulombFriction((0,), {}, ("run_1",)), (0,), (1,)),
    ]


def autoregression() -> NoiseModel:
    """Of two joints, of different orders."""
    return NoiseModel((np.array([0.9, -0.3]), np.array([0.5])), np.array([0.7, 2.0]))


@dataclass(frozen=True)
class Rows:
    """All whitened rows: x (N, columns), y (N,), fold, joint and side (N,); blocks of columns.

    `known` (m, FIXED + 1): rows [W target] that are in every fit and on no joint.
    """

    x: Array
    y: Array
    fold: np.ndarray
    joint: np.ndarray
    blocks: list[np.ndarray]
    known: Array
    side: np.ndarray

    def fitted(self, chosen: Sequence[int], kept: np.ndarray | None = None) -> Array:
        """Least squares of the model on the rows kept and what is known."""
        at = self.columns(chosen)
        kept = np.ones(len(self.y), bool) if kept is None else kept
        known = np.zeros((len(self.known), len(at)))
        known[:, :FIXED] = self.known[:, :-1]
        x = np.concatenate([self.x[kept][:, at], known])
        y = np.concatenate([self.y[kept], self.known[:, -1]])
        scale = np.linalg.norm(x, axis=0)
        scale[scale == 0] = 1.0
        return np.linalg.lstsq(x / scale, y, rcond=1e-12)[0] / scale

    def columns(self, chosen: Sequence[int]) -> np.ndarray:
        return np.concatenate([np.arange(FIXED), *(self.blocks[i] for i in chosen)]).astype(int)

    def energy(
        self, chosen: Sequence[int], joints: Sequence[int] = (0, 1), with_known: bool = False
    ) -> float:
        """Of the residual on the rows of `joints`, fitted to everything."""
        theta = self.fitted(chosen)
        rest = self.y - self.x[:, self.columns(chosen)] @ theta
        own = float(np.sum(rest[np.isin(self.joint, joints)] ** 2))
        misfit = self.known[:, :-1] @ theta[:FIXED] - self.known[:, -1]
        return own + with_known * float(misfit @ misfit)

    def on_blocks(self, chosen: Sequence[int]) -> Array:
        """Energy (joints, 2 folds) of the sides of folds, fitted to the other sides of all."""
        found = np.zeros((2, max(FOLDS) + 1, 2))
        for joint, fold, side in np.ndindex(found.shape):
            here = (self.fold == fold) & (self.side == bool(side)) & (self.joint == joint)
            theta = self.fitted(chosen, self.side != bool(side))
            rest = self.y[here] - self.x[here][:, self.columns(chosen)] @ theta
            found[joint, fold, side] = float(rest @ rest)
        return found.reshape(2, -1)

    def projected(self, column: int, chosen: Sequence[int]) -> float:
        """Energy of a column that the model cannot imitate, as a share of all of it."""
        known = np.column_stack([self.known[:, :-1], np.zeros(len(self.known))])
        changed = Rows(
            self.x, self.x[:, column], self.fold, self.joint, self.blocks, known, self.side
        )  # fmt: skip
        whole = float(self.x[:, column] @ self.x[:, column])
        return changed.energy(chosen, with_known=True) / whole


def covariance_in_time(taps: Array, sigma: float, count: int) -> Array:
    """Of `count` samples of an autoregression, from its response to an impulse."""
    response = lfilter([1.0], np.concatenate([[1.0], -taps]), np.eye(1, 4000)[0])
    lags = [response[: 4000 - k] @ response[k:] for k in range(count)]
    return sigma**2 * np.asarray(toeplitz(lags))


def rows_of(
    data: TrainingData,
    candidates: Sequence[Candidate],
    noise: NoiseModel,
    known: Array = NOTHING,
) -> Rows:
    """Whitened row by row: what those of the p rows before that are usable do not predict."""
    starts = FIXED + np.cumsum([0, *(c.width for c in candidates)])
    blocks = [np.arange(starts[i], starts[i + 1]) for i in range(len(candidates))]
    x, y, folds, joints, sides = [], [], [], [], []
    for part, fold in enumerate(data.folds):
        samples = len(data.tau[part])
        full = np.zeros((samples, data.n, int(starts[-1])))
        full[:, :, :FIXED] = data.declared[part]
        for c, block in zip(candidates, blocks, strict=True):
            for k, joint in enumerate(c.rows):
                full[:, joint, block] = c.columns[part][:, k]
        for joint in range(data.n):
            taps, usable = noise.coefficients[joint], data.runs[part].usable[:, joint]
            whole = covariance_in_time(taps, float(noise.sigma[joint]), len(taps) + 1)
            for t in np.flatnonzero(usable):
                past = [s for s in range(max(t - len(taps), 0), t) if usable[s]]
                lags = t - np.array(past, dtype=int)
                by = np.linalg.solve(whole[np.ix_(lags, lags)], whole[lags, 0])
                left = np.sqrt(whole[0, 0] - by @ whole[lags, 0])
                x.append((full[t, joint] - by @ full[past, joint]) / left)
                y.append((data.tau[part][t, joint] - by @ data.tau[part][past, joint]) / left)
                folds.append(fold)
                joints.append(joint)
                sides.append(data.sides.owners[part][t] % 2)
    return Rows(
        np.array(x), np.array(y), np.array(folds), np.array(joints), blocks, known, np.array(sides)
    )  # fmt: skip


Allowed = Callable[[Array, Sequence[int], Sequence[int]], bool]
LARGE = Seen(np.full(2, 1e12), np.zeros(2), 1e12)
SAMPLES = 50
TOTAL = SAMPLES * len(FOLDS)
RULES = Rules(0.01, 0.01)
ONE = NoiseModel.white(np.ones(2))
NO_MODEL: Any = None  # none of what is tried asks for it
NO_MOTION: Any = None


def on_joint_0(sizes: Sequence[float]) -> Array:
    """Torque (directions, 2) of joint 0 alone."""
    return np.stack([sizes, np.zeros(len(sizes))], axis=1)


def planted(
    effects: Sequence[Effect],
    torque: Array,
    mix: Array | None = None,
    noise: float = 1.0,
    declared: float = 0.0,
    seed: int = 0,
) -> tuple[TrainingData, list[Candidate]]:
    """Orthogonal directions of RMS one in every part, of which columns and torque are made.

    Columns of all effects in turn are directions @ `mix` (on all their joints), torque is
    directions @ `torque` (directions, joints), `declared` of the declared model, and noise that is
    orthogonal to all of them and of exactly this RMS. So every fold says the same.
    """
    rng = np.random.default_rng(seed)
    count = FIXED + len(torque)
    fixed, columns, tau = [], [], []
    for _ in FOLDS:
        free, _ = np.linalg.qr(rng.normal(size=(SAMPLES, count + 2)))
        free *= np.sqrt(SAMPLES)
        fixed.append(np.repeat(free[:, None, :FIXED], 2, axis=1))
        own = free[:, FIXED:count]
        columns.append(own if mix is None else own @ mix)
        tau.append(own @ torque + noise * free[:, count:] + declared * free[:, :1])
    candidates, at = [], 0
    for one in effects:
        block = slice(at, at + len(one.parameters))
        blocks = tuple(np.repeat(c[:, None, block], len(one.joints), axis=1) for c in columns)
        candidates.append(Candidate(one, one.joints, blocks))
        at = block.stop
    runs = tuple(prepared(np.ones((SAMPLES, 2), bool)) for _ in FOLDS)
    return TrainingData(runs, FOLDS, tuple(fixed), tuple(tau)), candidates


def judge_of(
    data: TrainingData,
    candidates: Sequence[Candidate],
    rules: Rules = RULES,
    allowed: Allowed | None = None,
) -> Judgement:
    """Samples are independent and of unit noise; sizes are those that are possible."""
    plain = data.evidence(candidates, ONE)
    sizes = PossibleSizes(candidates, plain.covariance, LARGE)
    return Judgement(plain, plain, candidates, rules, sizes if allowed is None else allowed)


def traced(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    allowed: Allowed = anything,
) -> SearchResult:
    judge = judge_of(data, candidates, allowed=allowed)
    sizes = PossibleSizes(candidates, judge.plain.covariance, Seen(np.ones(2), np.ones(2), 1.0))
    return SearchResult(
        data, tuple(candidates), ONE, judge, tuple(chosen), np.zeros(0), (), np.ones(2), 1.0,
        sizes, NO_MODEL, NO_MOTION,
    )  # fmt: skip
