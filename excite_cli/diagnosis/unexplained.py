"""What is still structured and fits no name: on what does it depend?

Smooth functions of one quantity at a time are tested like any candidate: time, position, speed and
acceleration of every joint, the joint's own direction and load, where its position and its load
came from (hysteresis), and declared columns of the log, in each direction of motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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
    histories_of = [histories([getattr(s, name) for s in signals]) for name in ("q", "load")]
    spool = Spool()
    features = [
        [replace(one, columns=tuple(map(spool.keep, one.columns))) for one in own]
        for own in each(_features, (data, signals, histories_of, joint_names), range(data.n))
    ]
    found: dict[int, Unexplained] = {}
    shares: Array | None = None
    while len(found) < data.n:
        both = NoiseModel.white(noise.sigma), noise
        known = [data.grams(kept, some, range(data.n)) for some in both]
        of_model = data, [Shown(c.rows, c.columns) for c in kept], noise, known, rules
        open_ = [own for joint, own in enumerate(features) if joint not in found]
        structures = list(each(_structure, of_model, open_))
        if shares is None:  # nothing but the effects that were found is in the model yet
            shares = np.stack([own.shares for own in structures])
        told = [own for own in structures if own.is_told]
        if not told:
            break
        strongest = max(own.score for own in told)
        for own in told:
            if own.score < _AS_STRONG * strongest:
                continue
            joint = own.named[0].rows[0]
            covariates = tuple(feature.covariate for feature in own.named)
            found[joint] = Unexplained(joint_names[joint], covariates, own.share)
            kept += own.named
    assert shares is not None
    quantities = tuple(feature.covariate.common for feature in features[0])
    dependence = Dependence(tuple(joint_names), quantities, shares)
    return [found[joint] for joint in sorted(found)], dependence


@dataclass(frozen=True)
class Feature(Shown):
    """Smooth functions of one quantity, with free coefficients; not an effect with a name."""

    covariate: Covariate


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

    @property
    def is_told(self) -> bool:
        return bool(self.named) and self.share >= _LEAST_SHARE and self.size >= _SMALLEST


def _structure(
    shared: tuple[
        TrainingData,
        Sequence[Columns],
        NoiseModel,
        Sequence[dict[int, JointGram]],
        tuple[float, float, float],
    ],
    features: list[Feature],
    tell: Tell,
) -> _Structure:
    """Add the features of one joint to the model with those `kept`, while they pass.

    They leave the rows of all other joints, whose Gram matrices are known, as they are.
    """
    data, kept, noise, known, (significance, least_gain, inflation) = shared
    joint = features[0].rows[0]
    pool: list[Columns] = [*kept, *features]
    plain_others, others = ({j: gram for j, gram in grams.items() if j != joint} for grams in known)
    plain = data.evidence(pool, NoiseModel.white(noise.sigma), plain_others)
    base = list(range(len(kept)))
    obvious = _obvious(plain, base, joint)
    if obvious != base:
        left = data.residuals(pool, obvious, plain.solve(obvious))
        noise, others = fit_noise(left, [run.usable for run in data.runs]), {}
    white = data.evidence(pool, noise, others)
    sure = significance / (len(features) * data.n)
    chosen, score = list(base), -np.inf
    while len(chosen) < len(base) + _MOST_NAMED:
        best = _best(white, plain, chosen, joint, (sure, least_gain, inflation))
        if best is None:
            break
        score = max(score, best[0])
        chosen.append(best[1])
    before = plain.energy_on(base, [joint])
    share = 1.0 - plain.energy_on(chosen, [joint]) / max(before, 1e-300)
    whole = plain.grams.torque_energy(joint)
    return _Structure(
        [features[i - len(base)] for i in chosen[len(base) :]],
        score,
        float(share),
        float(np.sqrt(max(share, 0.0) * before / max(whole, 1e-300))),
        confirmed_shares(plain, base, joint),
    )


def _left_out(plain: Evidence, chosen: list[int], joint: int) -> tuple[float, dict[int, float]]:
    """Energy on runs left out: of the model, and of it with each feature that it lacks."""
    others = [i for i in range(len(plain.blocks)) if i not in chosen]
    after = plain.by_fold.with_each(chosen, others, [joint])
    before = float(plain.by_fold.energies(chosen, [joint]).sum())
    return before, {i: float(energy.sum()) for i, energy in after.items()}


def _obvious(plain: Evidence, base: list[int], joint: int) -> list[int]:
    """The `base` with features that lower the error on runs left out by a tenth, in any noise.

    A residual with strong structure passes for noise with a long memory, which would hide it.
    """
    chosen = list(base)
    while len(chosen) < len(base) + _MOST_NAMED:
        before, after = _left_out(plain, chosen, joint)
        best = min(after, key=after.__getitem__)
        if after[best] > (1.0 - _PLAIN_TO_SEE) ** 2 * before:
            break
        chosen.append(best)
    return chosen


def _best(
    white: Evidence,
    plain: Evidence,
    chosen: list[int],
    joint: int,
    rules: tuple[float, float, float],
) -> tuple[float, int] | None:
    """The feature whose χ² is farthest above that of chance, and by how much; None: none is."""
    sure, least_gain, inflation = rules
    schur = white.schur(chosen)
    before, after = _left_out(plain, chosen, joint)
    best: tuple[float, int] | None = None
    for i, energy in after.items():
        gain = schur.gain(i)
        if gain.dof == 0 or 1.0 - np.sqrt(energy / max(before, 1e-300)) < least_gain:
            continue
        score = gain.chi2 / inflation - float(chi2.isf(sure, gain.dof))
        if score >= 0.0 and (best is None or score > best[0]):
            best = (score, i)
    return best


def _features(
    shared: tuple[TrainingData, Sequence[Signals], list[list[Array]], Sequence[str]],
    joint: int,
    tell: Tell,
) -> list[Feature]:
    data, signals, histories_of, joint_names = shared
    own = joint_names[joint]
    functions = list(_functions(signals, joint, joint_names, data.runs[0].base_rows))
    of_position = Covariate("position", own, Aspect.HISTORY)
    of_load = Covariate("load", own, Aspect.HISTORY)
    for covariate, series in zip((of_position, of_load), histories_of, strict=True):
        functions.append((covariate, [x[:, joint] for x in series]))
    return [
        Feature(
            (joint,),
            tuple(
                run.averaged_for_fit(x[:, None], [joint])
                for x, run in zip(series, data.runs, strict=True)
            ),
            covariate,
        )
        for covariate, series in functions
    ]


def _functions(
    signals: Sequence[Signals], joint: int, joint_names: Sequence[str], base_rows: int
) -> Iterator[tuple[Covariate, list[Array]]]:
    """Smooth functions (T, p) of one quantity per part, for one joint's residual.

    How a base sways (the first rows) is known hardly beyond its noise.
    """
    own = joint_names[joint]
    longest = float(max(s.t[-1] for s in signals))
    yield Covariate("time"), [_powers(s.t, longest) for s in signals]
    for k, name in enumerate(joint_names[base_rows:], base_rows):
        yield Covariate("position", name), [_waves(s.q[:, k]) for s in signals]
        yield Covariate("speed", name), _odd_even([s.v[:, k] for s in signals], 5)
        yield Covariate("acceleration", name), _odd_even([s.a[:, k] for s in signals], 3)
    ways = [np.tanh(1e3 * s.v[:, joint, None]) for s in signals]
    yield (
        Covariate("position", own, Aspect.DIRECTION),
        [way * _waves(s.q[:, joint]) for way, s in zip(ways, signals, strict=True)],
    )
    yield Covariate("load", own), _odd_even([s.load[:, joint] for s in signals], 3)
    for name in signals[0].covariates:
        series = [s.covariates[name] for s in signals]
        every = np.concatenate(series)
        powers = [_powers(x - every.mean(), float(np.ptp(every))) for x in series]
        # Even and odd in the direction of motion: friction may follow a column.
        yield (
            Covariate("covariate", name),
            [np.concatenate([x, way * x], axis=1) for x, way in zip(powers, ways, strict=True)],
        )


def _powers(t: Array, longest: float) -> Array:
    x = t / max(longest, 1e-12)
    return np.stack([x, x**2, x**3], axis=1)


def _waves(q: Array) -> Array:
    return np.stack([f(k * q) for k in (1, 2, 3) for f in (np.sin, np.cos)], axis=1)


def _odd_even(series: Sequence[Array], count: int) -> list[Array]:
    """The first `count` functions of a quantity over its largest value."""
    largest = max(float(np.abs(x).max()) for x in series) + 1e-12
    scaled = [x / largest for x in series]
    return [
        np.stack([x, np.abs(x), x * np.abs(x), np.tanh(20 * x), x**3], axis=1)[:, :count]
        for x in scaled
    ]
