"""What a diagnosis will make of an effect of known size, before it is tried.

With G = CᵀC of the recordings and k the columns that an effect p is tried beside, both as in
`power.py`, let S = G − G_·k (G_kk + P)⁻¹ G_k·, and z the parameters of p in prior deviations.
Nothing in k imitates the energy λ = zᵀ S_pp z [χ²] of its torque. It is named with the probability

    Φ(√λ − √c) + Φ(−√λ − √c),

c its price, unless s = ν √(λ/N), a share of the torque's RMS, is below `rules.SMALLEST`: ν is the
noise of a sample as such a share, N the number of samples. Of a robot whose inertias are off by the
share u, s is large enough with the probability Φ(ln(s / SMALLEST) / u). Fitted in its place, k
leaves of it the energy E_b in block b of the held-out recording. Drawn with replacement, blocks
confirm it (2.5 % of the draws may say otherwise, `held_out_verdict.py`) with about the probability

    Φ(Σ E_b / √(Σ (E_b − Ē)² + 4 Σ E_b) − 1.96):

what shows in a few blocks only is not confirmed, however large. Rows of C are averages as those of
a fit, which leaves out the instants about reversals, and those in which a joint hardly moves
(`prepare.py`): Stribeck friction has most of its torque there. Another effect d cannot imitate

    E = zᵀ (S_pp − S_pd S_dd⁻¹ S_dp) z

of it. Of a robot that has p, what p saves beyond d is about N(E, 4 E), so that p is preferred with
the probability Φ((E + c_d − c_p) / 2√E). Where base parameters and declared effects alone leave
less than 0.1 % of the energy of p, inertias take it up, and a diagnosis lists it as such. What the
textbook has on every joint is in the model from `rules.MATTERS` on, whatever it costs and whatever
is like it; two standard deviations confirm it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.power import RIDGE, TEXTBOOK, price, probability_named
from excite_cli.diagnosis.schur import ABSORBED
from excite_cli.effects.base import Effect
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.prediction import Prediction
from excite_cli.excitation.problem import Problem
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment

_CONFIRMED = norm.ppf(0.975)
_DOUBT = 4.0  # χ² of two standard deviations
_NOTHING = 1e-12  # of an energy: rounding


@dataclass(frozen=True)
class PredictedOutcome:
    """Probabilities that an effect is `named` and confirmed, and preferred to a `rival` (`apart`).

    `absorbed`: inertias take it up; `rival`: kind and names of joints.
    """

    named: float
    apart: float = 1.0
    absorbed: bool = False
    rival: tuple[str, tuple[str, ...]] | None = None


def predict_outcome(
    prediction: Prediction,
    stack: Stack,
    blocks: Array | None,
    significance: float,
    effect: Effect,
    values: Array,
    noise: float,
    unsure: float = 0.0,
) -> PredictedOutcome:
    """For `effect` with its parameters `values` in their units.

    `blocks` (B, m, c): rows of the held-out recording, cut into blocks; None where others are sure
    to be confirmed with it. `noise`, `unsure`: ν and u of the module, those of all rows. What is
    none of the prediction's effects shows on no motion.
    """
    if effect not in prediction.extension.effects:
        return PredictedOutcome(0.0)
    effects, rank = prediction.extension.effects, prediction.rank
    own, gram = effects.index(effect), stack.factor.T @ stack.factor
    slices = prediction.extension.columns().slices
    columns = [np.arange(part.start, part.stop) + rank for part in slices]
    p, z = columns[own], values / prediction.extension.scales[columns[own] - rank]
    there = [at for at in range(prediction.declared) if at != own]
    textbook = [at for at, it in enumerate(effects) if it.kind in TEXTBOOK and at != own]
    beside = sorted({*there, *textbook})
    rivals = [
        at
        for at, it in enumerate(effects)
        if at not in (own, *beside) and len(columns[at]) <= len(p) and effect.kind not in it.refines
    ]

    def left_by(some: list[int]) -> tuple[Array, Array]:
        return _left(gram, np.concatenate([np.arange(rank), *(columns[k] for k in some)]), rank)

    bare, _ = left_by(there)
    if not effect.refines and bare[p[0], p[0]] <= ABSORBED * gram[p[0], p[0]]:
        return PredictedOutcome(0.0, absorbed=True)
    left, residual = left_by(beside)
    energy, cost = float(z @ left[np.ix_(p, p)] @ z), price(type(effect), significance)
    samples = max(1.0, stack.rows / len(prediction.usual))
    share = noise * np.sqrt(max(energy, 0.0) / samples)
    if not share >= rules.SMALLEST * np.exp(-_DOUBT * unsure):
        return PredictedOutcome(0.0)
    large = float(norm.cdf(np.log(share / rules.SMALLEST) / unsure)) if unsure else 1.0
    always = effect.kind in TEXTBOOK and share >= rules.MATTERS
    named = large * probability_named(float(np.sqrt(energy)), _DOUBT if always else cost)
    if blocks is not None:
        missed = np.square(blocks @ residual[:, p] @ z).sum(axis=1)
        spread = np.sqrt(np.square(missed - missed.mean()).sum() + 4.0 * missed.sum())
        named *= float(norm.cdf(missed.sum() / max(spread, _NOTHING) - _CONFIRMED))
    preferred: list[tuple[float, int]] = []
    for at in rivals:
        d = columns[at]
        solved = np.linalg.lstsq(left[np.ix_(d, d)], left[np.ix_(d, p)] @ z, rcond=1e-6)[0]
        alone = max(energy - float(z @ left[np.ix_(p, d)] @ solved), _NOTHING * energy)
        dearer = price(type(effects[at]), significance) - cost
        preferred.append((float(norm.cdf(0.5 * (alone + dearer) / np.sqrt(alone))), at))
    if always or not preferred:
        return PredictedOutcome(named)
    apart, at = min(preferred)
    names = prediction.extension.robot.joint_names
    return PredictedOutcome(
        named, apart, False, (effects[at].kind, tuple(names[j] for j in effects[at].joints))
    )


def rows_of_fit(problem: Problem, motion: Segment, run: PreparedRun) -> Array:
    """Rows (M·R, c) of a motion as the fit of its recording `run` averages them.

    In units of the noise of a mean over `run.step`; zero where the fit has none.
    """
    states, robot = motion.trajectory.states(run.t, motion.coefficients), problem.robot
    block = problem.objective().block_of(run.t, *states).reshape(len(run.t), len(robot.rows), -1)
    seconds = problem.spec.task.rate * problem.trajectory.duration
    block *= np.sqrt(len(problem.cost_basis.times) / seconds)
    rows = [run.fit_averages[j] @ block[:, k] for k, j in enumerate(robot.rows)]
    usable = run.usable[:, list(robot.rows)].T[..., None]
    return np.where(usable, rows, 0.0).transpose(1, 0, 2).reshape(-1, block.shape[-1])


def _left(gram: Array, beside: Array, rank: int) -> tuple[Array, Array]:
    """S (c, c) of what the columns `beside` leave, of which the first `rank` are inertias.

    And T (c, c): rows times T are what they leave of rows, fitted to the data of `gram`.
    """
    known = gram[np.ix_(beside, beside)] + np.diag(np.where(beside < rank, 0.0, 1.0))
    known[np.diag_indices(rank)] *= 1.0 + RIDGE
    size = np.sqrt(np.maximum(np.diag(known), 1e-300))
    inverse = np.linalg.pinv(known / np.outer(size, size), hermitian=True) / np.outer(size, size)
    residual = np.eye(len(gram))
    residual[beside] -= inverse @ gram[beside]
    return gram @ residual, residual
