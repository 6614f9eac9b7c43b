"""What is still structured and fits no name: on what does it depend?

Smooth functions of one quantity at a time are tested like any candidate: time, position, speed and
acceleration of every joint, the joint's own direction and load, where its position and its load
came from (hysteresis), and declared columns of the log, in each direction of motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.stats import chi2

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.covariate import Aspect, Covariate
from excite_cli.diagnosis.dependence import confirmed_shares
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.grams import JointGram
from excite_cli.diagnosis.history import histories
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.records import Unexplained
from excite_cli.diagnosis.traces import Dependence
from excite_cli.diagnosis.training import Columns, Shown, TrainingData
from excite_cli.effects.base import Signals
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

_MOST_NAMED = 3
# Of 260 simulated campaigns, eight had less told, three of them of robots without defects, and all
# of joints on which fits leave noise alone; of those with something left, none had.
_LEAST_SHARE = 0.05
_SMALLEST = 1e-3  # of the torque's RMS
_PLAIN_TO_SEE = 0.1  # of the error on runs left out
# Of the strongest: less may be what that bends. One joint after another took a fifth of the time.
_AS_STRONG = 0.2


def unexplained_structure(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    signals: Sequence[Signals],
    noise: NoiseModel,
    rules: tuple[float, float, float],
    joint_names: Sequence[str],
) -> tuple[list[Unexplained], Dependence]:
    """Joints whose residual depends on something, and on what; and all dependences, as a map.

    `rules` are α of the family, least gain on runs left out, and inflation of χ². The joints with
    the strongest structure come first, and the others are judged with it in the model: through the
    inertias that all rows share, it bends their residuals too.
    """
    kept: list[Columns] = [candidates[i] for i in chosen]
    past = _Past.of(signals)
    spool = Spool()
    shown = (data, signals, past, joint_names)
    features = [_kept(spool, own) for own in each(_features, shown, range(data.n))]
    found: dict[int, Unexplained] = {}
    shares: Array | None = None
    plain_noise = NoiseModel.white(noise.sigma)
    while len(found) < data.n:
        known = _Known(
            data.grams(kept, plain_noise, range(data.n)), data.grams(kept, noise, range(data.n))
        )
        open_ = [features[joint] for joint in range(data.n) if joint not in found]
        of_model = (data, [Shown(c.rows, c.columns, c.width) for c in kept], noise, known, rules)
        structures = list(each(_structure, of_model, open_))
        if shares is None:  # nothing but the effects that were found is in the model yet
            shares = np.stack([each.shares for each in structures])
        told = [each for each in structures if _is_told(each)]
        if not told:
            break
        strongest = max(each.score for each in told)
        for own in told:
            if own.score < _AS_STRONG * strongest:
                continue
            joint = own.named[0].rows[0]
            covariates = tuple(feature.covariate for feature in own.named)
            found[joint] = Unexplained(joint_names[joint], covariates, own.share)
            kept += own.named
    assert shares is not None
    quantities = tuple(each.covariate.common for each in features[0])
    dependence = Dependence(tuple(joint_names), quantities, shares)
    return [found[joint] for joint in sorted(found)], dependence


@dataclass(frozen=True)
class Feature:
    """Smooth functions of one quantity, with free coefficients; not an effect with a name."""

    covariate: Covariate
    rows: tuple[int, ...]
    columns: tuple[Array, ...]

    @property
    def width(self) -> int:
        """Number of functions."""
        return int(self.columns[0].shape[2])


@dataclass(frozen=True)
class _Structure:
    """What a joint's residual depends on, how surely, and the share of it that this explains.

    `size`: the RMS of what is explained, over that of the torque. `shares` (K,) are those that each
    quantity alone explains, confirmed on runs left out.
    """

    named: list[Feature]
    score: float
    share: float
    size: float
    shares: Array


@dataclass(frozen=True)
class _Known:
    """Gram matrices of every joint's rows without features, plain and whitened.

    Features of one joint leave those of all others as they are.
    """

    plain: dict[int, JointGram]
    white: dict[int, JointGram]


@dataclass(frozen=True)
class _Past:
    """Histories (T, n, 3) of the positions and of the loads of every part."""

    q: list[Array]
    load: list[Array]

    @classmethod
    def of(cls, signals: Sequence[Signals]) -> "_Past":
        return cls(histories([s.q for s in signals]), histories([s.load for s in signals]))


def _features(
    shared: tuple[TrainingData, Sequence[Signals], _Past, Sequence[str]], joint: int, tell: Tell
) -> list[Feature]:
    data, signals, past, joint_names = shared
    covariates, columns = _quantities(data, signals, joint, joint_names)
    own = joint_names[joint]
    for covariate, series in (
        (Covariate("position", own, Aspect.HISTORY), past.q),
        (Covariate("load", own, Aspect.HISTORY), past.load),
    ):
        covariates.append(covariate)
        columns.append(
            tuple(
                run.averaged_for_fit(x[:, None, joint], [joint])
                for x, run in zip(series, data.runs, strict=True)
            )
        )
    return [
        Feature(covariate, (joint,), tuple(blocks))
        for covariate, blocks in zip(covariates, columns, strict=True)
    ]


def _kept(spool: Spool, features: Sequence[Feature]) -> list[Feature]:
    return [replace(each, columns=tuple(map(spool.keep, each.columns))) for each in features]


def _structure(
    shared: tuple[TrainingData, Sequence[Columns], NoiseModel, _Known, tuple[float, float, float]],
    features: list[Feature],
    tell: Tell,
) -> _Structure:
    """Add the features of one joint to the model with those `kept`, while they pass."""
    data, kept, noise, known, rules = shared
    joint = features[0].rows[0]
    pool: list[Columns] = [*kept, *features]
    plain_others, others = _without(known.plain, joint), _without(known.white, joint)
    plain = data.evidence(pool, NoiseModel.white(noise.sigma), plain_others)
    base = list(range(len(kept)))
    obvious = _obvious(plain, base, joint)
    if obvious:
        with_them = [*base, *obvious]
        left = data.residuals(pool, with_them, plain.solve(with_them))
        noise, others = fit_noise(left, [run.usable for run in data.runs]), {}
    white = data.evidence(pool, noise, others)
    named: list[int] = []
    score = -np.inf
    tests = len(features) * data.n
    while len(named) < _MOST_NAMED:
        best = _best(white, plain, [*base, *named], len(kept), joint, tests, *rules)
        if best is None:
            break
        score = max(score, best[0])
        named.append(best[1])
    before = plain.energy_on(base, [joint])
    share = 1.0 - plain.energy_on([*base, *named], [joint]) / max(before, 1e-300)
    whole = plain.grams.torque_energy(joint)
    return _Structure(
        [features[i - len(kept)] for i in named],
        score,
        float(share),
        float(np.sqrt(max(share, 0.0) * before / max(whole, 1e-300))),
        confirmed_shares(plain, base, joint),
    )


def _is_told(found: _Structure) -> bool:
    return bool(found.named) and found.share >= _LEAST_SHARE and found.size >= _SMALLEST


def _without(grams: dict[int, JointGram], joint: int) -> dict[int, JointGram]:
    return {j: gram for j, gram in grams.items() if j != joint}


def _obvious(plain: Evidence, base: list[int], joint: int) -> list[int]:
    """Features that lower the error on runs left out by a tenth or more, whatever the noise.

    A residual with strong structure passes for noise with a long memory, which would hide it.
    """
    found: list[int] = []
    while len(found) < _MOST_NAMED:
        model = [*base, *found]
        before = plain.by_fold.energies(model, [joint]).sum()
        others = [i for i in range(len(base), len(plain.blocks)) if i not in found]
        after = plain.by_fold.with_each(model, others, [joint])
        best = min(after, key=lambda i: after[i].sum())
        if after[best].sum() > (1.0 - _PLAIN_TO_SEE) ** 2 * before:
            break
        found.append(best)
    return found


def _best(
    white: Evidence,
    plain: Evidence,
    chosen: list[int],
    first: int,
    joint: int,
    tests: int,
    significance: float,
    least_gain: float,
    inflation: float,
) -> tuple[float, int] | None:
    schur = white.schur(chosen)
    best: tuple[float, int] | None = None
    others = [i for i in range(first, len(white.blocks)) if i not in chosen]
    before = plain.by_fold.energies(chosen, [joint]).sum()
    after = plain.by_fold.with_each(chosen, others, [joint])
    for i in others:
        gain = schur.gain(i)
        if gain.dof == 0:
            continue
        p = float(tests * chi2.sf(gain.chi2 / inflation, gain.dof))
        if p > significance:
            continue
        if 1.0 - np.sqrt(after[i].sum() / max(before, 1e-300)) < least_gain:
            continue
        score = gain.chi2 / inflation - float(chi2.isf(significance / tests, gain.dof))
        if best is None or score > best[0]:
            best = (score, i)
    return best


def _quantities(
    data: TrainingData, signals: Sequence[Signals], joint: int, joint_names: Sequence[str]
) -> tuple[list[Covariate], list[tuple[Array, ...]]]:
    """Covariates and their columns (M, 1, p) per part."""
    covariates = [Covariate("time")]
    longest = float(max(x.t[-1] for x in signals))
    made: list[Callable[[Signals], Array]] = [lambda s: _powers(s.t, longest)]
    first = data.runs[0].base_rows  # how a base sways is known hardly beyond its noise
    for k, name in enumerate(joint_names[first:], first):
        fastest = max(float(np.abs(s.v[:, k]).max()) for s in signals) + 1e-12
        strongest = max(float(np.abs(s.a[:, k]).max()) for s in signals) + 1e-12
        made.append(partial(_of_position, k))
        covariates.append(Covariate("position", name))
        made.append(partial(_of_speed, k, fastest))
        covariates.append(Covariate("speed", name))
        made.append(partial(_of_acceleration, k, strongest))
        covariates.append(Covariate("acceleration", name))
    made.append(partial(_of_direction_and_position, joint))
    covariates.append(Covariate("position", joint_names[joint], Aspect.DIRECTION))
    heaviest = max(float(np.abs(s.load[:, joint]).max()) for s in signals) + 1e-12
    made.append(lambda s: _odd_even(s.load[:, joint] / heaviest)[:, :3])
    covariates.append(Covariate("load", joint_names[joint]))
    for name in signals[0].covariates:
        seen = np.concatenate([s.covariates[name] for s in signals])
        made.append(partial(_of_column, name, joint, float(seen.mean()), float(np.ptp(seen))))
        covariates.append(Covariate("covariate", name))
    columns = [
        tuple(
            run.averaged_for_fit(make(s)[:, None], [joint])
            for s, run in zip(signals, data.runs, strict=True)
        )
        for make in made
    ]
    return covariates, columns


def _of_position(k: int, s: Signals) -> Array:
    return _waves(s.q[:, k])


def _of_speed(k: int, scale: float, s: Signals) -> Array:
    return _odd_even(s.v[:, k] / scale)


def _of_direction_and_position(k: int, s: Signals) -> Array:
    return np.tanh(1e3 * s.v[:, k, None]) * _waves(s.q[:, k])


def _of_acceleration(k: int, scale: float, s: Signals) -> Array:
    return _odd_even(s.a[:, k] / scale)[:, :3]


def _of_column(name: str, joint: int, middle: float, width: float, s: Signals) -> Array:
    """Even and odd in the direction of motion: friction may follow a column."""
    powers = _powers(s.covariates[name] - middle, width)
    return np.concatenate([powers, np.tanh(1e3 * s.v[:, joint, None]) * powers], axis=1)


def _powers(t: Array, longest: float) -> Array:
    x = t / max(longest, 1e-12)
    return np.stack([x, x**2, x**3], axis=1)


def _waves(q: Array) -> Array:
    return np.stack([f(k * q) for k in (1, 2, 3) for f in (np.sin, np.cos)], axis=1)


def _odd_even(x: Array) -> Array:
    return np.stack([x, np.abs(x), x * np.abs(x), np.tanh(20 * x), x**3], axis=1)
