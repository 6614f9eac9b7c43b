"""Gram matrices and Schur complements against least squares on stacked rows."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence, Grams, JointGram
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.schur import ABSORBED, Cholesky
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.armature import Armature
from excite_cli.effects.torque_gain import TorqueGain
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import (
    FIXED,
    FOLDS,
    NOTHING,
    PRIOR,
    WEIGHED,
    Rows,
    autoregression,
    random_candidates,
    random_data,
    rows_of,
)

CHOSEN = [(), (0,), (2,), (1, 3), (3, 0, 2), (4,), (0, 1, 2, 3, 4)]
WHITE = NoiseModel.white(np.array([0.5, 3.0]))


@pytest.fixture(scope="module", params=["white", "autoregression", "prior", "weighed"])
def both(request: pytest.FixtureRequest) -> tuple[Evidence, Rows]:
    known = {"prior": PRIOR, "weighed": WEIGHED}.get(request.param, NOTHING)
    data, candidates = random_data(3, known), random_candidates(3)
    noise = WHITE if request.param == "white" else autoregression()
    return data.evidence(candidates, noise), rows_of(data, candidates, noise, known)


@pytest.mark.parametrize("chosen", CHOSEN)
def test_parameters_and_energies(both: tuple[Evidence, Rows], chosen: tuple[int, ...]) -> None:
    evidence, rows = both
    assert evidence.solve(chosen) == pytest.approx(rows.fitted(chosen), rel=1e-6, abs=1e-8)
    assert evidence.energy(chosen) == pytest.approx(rows.energy(chosen, with_known=True), rel=1e-8)
    for joints in ([0], [1], [0, 1]):
        assert evidence.energy_on(chosen, joints) == pytest.approx(
            rows.energy(chosen, joints), rel=1e-8
        )
    assert evidence.energy_on(chosen, None) == pytest.approx(rows.energy(chosen), rel=1e-8)


def test_covariance_is_the_inverse_of_the_normal_matrix(both: tuple[Evidence, Rows]) -> None:
    """And gains of several and of pairs are what the residual loses."""
    evidence, rows = both
    chosen = (0, 3)
    x = rows.x[:, rows.columns(chosen)]
    normal = x.T @ x
    normal[:FIXED, :FIXED] += rows.known[:, :-1].T @ rows.known[:, :-1]
    assert evidence.covariance(chosen) == pytest.approx(np.linalg.inv(normal), rel=1e-6, abs=1e-12)
    # An effect of one fold is there in it alone.
    evidence, _ = both
    assert evidence.folds_of([4]).tolist() == [False, True, False]
    assert evidence.folds_of([0, 4]).all()
    # Gains of several and of pairs.
    evidence, rows = both
    schur = evidence.schur((2,))
    before = rows.energy((2,), with_known=True)
    pairs = [(0, 1), (0, 3), (1, 3), (3, 4), (0, 4)]
    found = schur.pair_chi2(*np.array(pairs).T)
    for pair, value in zip(pairs, found, strict=True):
        expected = before - rows.energy([2, *pair], with_known=True)
        assert value == pytest.approx(expected, rel=1e-6)
        together = schur.gain(*pair)
        assert (together.chi2, together.dof) == (pytest.approx(expected, rel=1e-6), 2)


@pytest.mark.parametrize("chosen", CHOSEN)
def test_errors_on_blocks_fitted_to_the_others(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...]
) -> None:
    evidence, rows = both
    sides = evidence.in_turn.energies(chosen)
    assert sides.ravel() == pytest.approx(rows.on_blocks(chosen).ravel(), rel=1e-6)
    assert evidence.in_turn.energies(chosen, [1]) == pytest.approx(sides[1:], rel=1e-9)
    for joint in (0, 1):
        whole = evidence.seen.energies(chosen)[joint, 0]
        assert whole == pytest.approx(rows.energy(chosen, [joint]), rel=1e-6)


@pytest.mark.parametrize("chosen", [c for c in CHOSEN if c])
def test_blocks_say_at_once_what_a_model_is_without_each_member(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...]
) -> None:
    """Which is a downdate of the whole model's fit away."""
    evidence, _ = both
    for blocks in (evidence.in_turn, evidence.seen):
        for member, energies in blocks.without_each(chosen).items():
            rest = tuple(sorted(i for i in chosen if i != member))
            expected = blocks._anew(rest)
            blocks._fitted.clear()
            blocks.fit(chosen)
            found = blocks._fits(rest)
            assert not found.exact
            assert found.at.tolist() == expected.at.tolist()
            assert found.parameters == pytest.approx(expected.parameters, rel=1e-6, abs=1e-9)
            assert energies == pytest.approx(blocks.energies(rest), rel=1e-6)


@pytest.mark.parametrize("chosen", CHOSEN)
@pytest.mark.parametrize("joints", [[0], [1], [0, 1]])
def test_blocks_say_at_once_what_a_model_is_with_each_of_others(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...], joints: list[int]
) -> None:
    evidence, _ = both
    others = [i for i in range(len(evidence.blocks)) if i not in chosen]
    for blocks in (evidence.in_turn, evidence.seen):
        for other, energies in blocks.with_each(chosen, others, joints).items():
            more = [*chosen, other]
            assert energies == pytest.approx(blocks.energies(more, joints), rel=1e-6)


@pytest.mark.parametrize("chosen", [c for c in CHOSEN if c])
def test_a_model_without_one_is_a_projection_away(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...]
) -> None:
    evidence, rows = both
    evidence.schur(chosen)
    solved = dict(evidence._wholes)
    for member in chosen:
        rest = [i for i in chosen if i != member]
        found = evidence.schur(rest[::-1]).singles  # whatever the order
        assert evidence._wholes == solved or evidence._weighed.any()  # nothing was solved for it
        expected = evidence._schur(rest).singles
        for i, one in found.items():
            if i not in rest:
                other = expected[i]
                assert one.chi2 == pytest.approx(other.chi2, rel=1e-6, abs=1e-9)
                assert one.left == pytest.approx(other.left, rel=1e-6)
        assert evidence.energy(rest) == pytest.approx(rows.energy(rest, with_known=True), rel=1e-8)


def test_what_a_fold_hardly_has_is_judged_as_if_it_had_none() -> None:
    """As Stribeck friction in a run that passes its speeds: others tell no size."""
    data, (candidate, *_) = random_data(5), random_candidates(5)
    faint = [2e-5 if fold != 0 else 1.0 for fold in data.folds]
    columns = tuple(c * k for c, k in zip(candidate.columns, faint, strict=True))
    torque = tuple(
        t + np.stack([8.0 * (c[:, 0] @ np.ones(c.shape[2])), 0.0 * t[:, 1]], axis=1)
        for t, c in zip(data.tau, columns, strict=True)
    )
    there = replace(data, tau=torque).evidence([replace(candidate, columns=columns)], WHITE)
    assert there.folds_of([0]).tolist() == [True, False, False]
    without, with_it = (there.in_turn.energies(chosen, [0]) for chosen in ((), (0,)))
    assert with_it[0, :2].sum() < 0.2 * without[0, :2].sum()


def test_columns_that_data_hardly_tell_apart_are_told_apart() -> None:
    """Two that differ by 3e-6, as sums and differences of a heavy arm's and its flange's do."""
    data, candidates = random_data(5), random_candidates(5)
    declared = tuple(d.copy() for d in data.declared)
    for d in declared:
        d[:, :, 2] = d[:, :, 0] + 3e-6 * d[:, :, 2] / 0.1
    size = np.array([4e6, 1.0, -4e6, 0.0])
    torque = tuple(t + d @ size for t, d in zip(data.tau, declared, strict=True))
    near = replace(data, declared=declared, tau=torque)
    rows = rows_of(near, candidates, WHITE, NOTHING)
    found = near.evidence(candidates, WHITE).solve((0,))
    assert found == pytest.approx(rows.fitted((0,)), rel=0.02, abs=0.05)


@pytest.mark.parametrize("chosen", [(), (0,), (1, 2)])
def test_gains_are_what_the_residual_loses(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...]
) -> None:
    evidence, rows = both
    schur = evidence.schur(chosen)
    before = rows.energy(chosen, with_known=True)
    for i in set(range(5)) - set(chosen):
        after = rows.energy([*chosen, i], with_known=True)
        gain = schur.gain(i)
        assert gain.chi2 == pytest.approx(before - after, rel=1e-6)
        assert gain.dof == len(rows.blocks[i])
        single = schur.singles[i]
        assert (single.chi2, single.dof) == (pytest.approx(gain.chi2), gain.dof)
        if gain.dof == 1:
            left = rows.projected(int(rows.blocks[i][0]), chosen)
            assert gain.left == pytest.approx(left, rel=1e-8)
            assert single.left == pytest.approx(gain.left)


@pytest.mark.parametrize("chosen", [(0,), (1, 3), (3, 0, 2), (0, 1, 2, 3, 4)])
def test_what_a_member_adds_is_what_the_others_lose_with_it(
    both: tuple[Evidence, Rows], chosen: tuple[int, ...]
) -> None:
    evidence, rows = both
    for i in chosen:
        rest = [k for k in chosen if k != i]
        lost = rows.energy(rest, with_known=True) - rows.energy(chosen, with_known=True)
        gain, explicit = evidence.gain_of(i, chosen), evidence.schur(rest).gain(i)
        assert gain.chi2 == pytest.approx(lost, rel=1e-6)
        assert (gain.dof, gain.left) == (explicit.dof, pytest.approx(explicit.left, rel=1e-6))


def test_what_the_model_holds_already_gains_nothing() -> None:
    """A copy of a declared column, a combination of two candidates, and a column of zeros."""
    data = random_data(5)
    first = random_candidates(5)[0]
    shape = first.columns[0].shape
    same = tuple(d[:, :1, 1:2] for d in data.declared)
    blind = replace(first, columns=tuple(np.zeros(shape) for _ in data.tau))
    own = replace(
        data, declared=tuple(np.where([[[True] * 4], [[False] * 4]], d.transpose(1, 0, 2), 0)
                             .transpose(1, 0, 2) for d in data.declared)
    )  # fmt: skip
    copy = Candidate(Armature((0,)), (0,), same)
    evidence = own.evidence([first, copy, blind], WHITE)
    schur = evidence.schur(())
    for i in (1, 2):
        gain = schur.gain(i)
        assert (gain.chi2, gain.dof) == (0.0, 0)
        assert gain.left < ABSORBED
        assert schur.singles[i].dof == 0
        assert evidence.energy((0, i)) == pytest.approx(evidence.energy((0,)), rel=1e-7)
    assert np.isfinite(evidence.solve((0, 1, 2))).all()


def test_collinear_pairs_gain_nothing_together() -> None:
    data = random_data(6)
    first, _, _, both_joints, _ = random_candidates(6)
    twin = replace(first, columns=tuple(2 * c + 1e-6 for c in first.columns))
    schur = data.evidence([first, twin, both_joints], WHITE).schur(())
    assert schur.pair_chi2(np.array([0, 0]), np.array([1, 2]))[0] == 0.0
    assert schur.pair_chi2(np.array([0]), np.array([2]))[0] > 0.0
    assert schur.gain(0, 1).dof == 1
    assert schur.gain(0, 1).chi2 == pytest.approx(schur.gain(0).chi2, rel=1e-4)
    # A two column candidate with one column absorbed has one left.
    data = random_data(8)
    candidates = random_candidates(8)
    two = candidates[2]
    held = tuple(
        np.concatenate([c[:, :, :1], candidates[0].columns[k]], axis=2)
        for k, c in enumerate(two.columns)
    )
    schur = data.evidence([candidates[0], replace(two, columns=held)], WHITE).schur((0,))
    rows = rows_of(data, [candidates[0], replace(two, columns=held)], WHITE)
    gain = schur.gain(1)
    assert gain.dof == 1
    lost = rows.energy((0,)) - rows.energy((0, 1))
    assert gain.chi2 == pytest.approx(lost, rel=1e-6)


def test_rows_that_are_not_usable_do_not_count() -> None:
    data, candidates = random_data(9), random_candidates(9)
    wild = tuple(
        np.where(run.usable, tau, 1e6) for run, tau in zip(data.runs, data.tau, strict=True)
    )
    for noise in (WHITE, autoregression()):
        one = data.evidence(candidates, noise)
        other = replace(data, tau=wild).evidence(candidates, noise)
        assert np.array_equal(one.grams.total(), other.grams.total())


GAIN, INERTIAS = 0.04, np.array([5.0, -3.0, 20.0, 8.0])
MASSES = np.array([1.0, 1.0, 0.0, 1.0])  # their sum was weighed


def weighed(std: float) -> Array:
    return np.append(MASSES, MASSES @ INERTIAS)[None] / std


def of_a_wrong_scale(std: float, seed: int = 4) -> tuple[TrainingData, Candidate, Array]:
    """Torques that are too large by `GAIN` all alike, with the gain's column, and what is known."""
    rng, known = np.random.default_rng(seed), weighed(std)
    data = random_data(seed, known)
    model = [d @ INERTIAS for d in data.declared]
    tau = tuple((1.0 + GAIN) * own + rng.normal(size=own.shape) for own in model)
    gain = Candidate(TorqueGain((0, 1)), (0, 1), tuple(own[:, :, None] for own in model))
    return replace(data, tau=tau), gain, known


@pytest.mark.parametrize("std", [1e-3, 0.3])
def test_what_was_weighed_tells_a_gain_that_the_inertias_hold(std: float) -> None:
    """Against stacked rows; of an exact one the weight's energy is far above that of the data."""
    data, gain, known = of_a_wrong_scale(std)
    evidence = data.evidence([gain], autoregression())
    rows = rows_of(data, [gain], autoregression(), known)
    told = evidence.schur(()).singles[0]
    assert evidence.schur(()).identified_by_prior_only(0)
    saved = rows.energy((), with_known=True) - rows.energy((0,), with_known=True)
    assert told.chi2 == pytest.approx(saved, rel=1e-5)
    assert told.dof == evidence.schur(()).gain(0).dof == 1
    assert evidence.energy((0,)) == pytest.approx(rows.energy((0,), with_known=True), rel=1e-4)
    assert evidence.solve((0,)) == pytest.approx(rows.fitted((0,)), rel=1e-4)
    assert evidence.solve((0,))[-1] == pytest.approx(GAIN, abs=4.0 * told.chi2**-0.5 * GAIN)


def test_without_weight_a_gain_is_absorbed_and_beside_itself_it_is_not_told_again() -> None:
    data, gain, _ = of_a_wrong_scale(0.3)
    free = replace(data, prior=None, weighed=None).evidence([gain], WHITE)
    kept = replace(data, weighed=None).evidence([gain], WHITE)  # by a prior, not a scale
    assert free.schur(()).singles[0].dof == 0
    assert not free.schur(()).identified_by_prior_only(0)
    assert not kept.schur(()).identified_by_prior_only(0)
    assert not data.evidence([gain, gain], WHITE).schur((0,)).identified_by_prior_only(1)
    # Data that tell an effect themselves are not said to need a weight.
    schur = data.evidence([gain, random_candidates(4)[0]], WHITE).schur(())
    assert [schur.identified_by_prior_only(i) for i in (0, 1)] == [True, False]


SIZE = 7


@pytest.fixture
def grams_and_full() -> tuple[Grams, np.ndarray]:
    """And in full, (F, 2, n, K, K)."""
    rng = np.random.default_rng(4)
    full = np.zeros((3, 2, 3, SIZE, SIZE))
    joints = []
    for j, active in enumerate(([0, 1, 2], [0, 1, 4, 5], [0, 1])):
        own = rng.normal(size=(3, 2, len(active) + 1, len(active) + 1))
        at = np.array([*active, SIZE - 1])
        full[:, :, j, at[:, None], at] = own
        joints.append(JointGram(np.array(active), own.reshape(-1, *own.shape[2:])))
    return Grams(joints, SIZE), full


def test_sums_over_folds_and_joints(grams_and_full: tuple[Grams, np.ndarray]) -> None:
    grams, full = grams_and_full
    assert grams.total() == pytest.approx(full.sum(axis=(0, 1, 2)))
    assert grams.seen() == pytest.approx(np.einsum("fsjkk->fsk", full).reshape(-1, SIZE))
    assert grams.torque_energy(1) == pytest.approx(full[:, :, 1, -1, -1].sum())


@pytest.mark.parametrize("size", [1, 2, 30])
def test_one_and_many_right_sides(size: int) -> None:
    rng = np.random.default_rng(size)
    rows = rng.normal(size=(2 * size, size))
    matrix, rhs = rows.T @ rows, rng.normal(size=(size, 3))
    kept = matrix.copy(), rhs.copy()
    factor = Cholesky(matrix)
    assert factor.solve(rhs) == pytest.approx(np.linalg.solve(matrix, rhs), rel=1e-8)
    assert factor.solve(rhs[:, 0]) == pytest.approx(np.linalg.solve(matrix, rhs[:, 0]), rel=1e-8)
    assert np.array_equal(matrix, kept[0])
    assert np.array_equal(rhs, kept[1])


def test_what_is_not_positive_definite_has_no_factor() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="column 2 of 3"):
        Cholesky(np.diag([1.0, -1.0, 1.0]))


@pytest.mark.parametrize("chosen", [(), (0,), (2,), (1, 3), (3, 2, 0), (4, 1)])
@pytest.mark.parametrize("joint", [0, 1])
def test_columns_times_parameters_are_the_model_of_that_joint(
    chosen: tuple[int, ...], joint: int
) -> None:
    """Against torque added up effect by effect, sample by sample."""
    data, candidates = random_data(11), random_candidates(11)
    widths = [candidates[i].width for i in chosen]
    theta = np.random.default_rng(0).normal(size=FIXED + sum(widths))
    starts = FIXED + np.cumsum([0, *widths])
    for part in range(len(FOLDS)):
        found = data.columns(candidates, chosen, part, joint)
        assert found.shape == (len(data.tau[part]), FIXED + sum(widths))
        for t in range(0, len(data.tau[part]), 7):
            expected = float(data.declared[part][t, joint] @ theta[:FIXED])
            for i, start in zip(chosen, starts, strict=False):
                own = candidates[i]
                values = theta[start : start + own.width]
                for row, acts_on in enumerate(own.rows):
                    if acts_on == joint:
                        expected += float(own.columns[part][t, row] @ values)
            assert found[t] @ theta == pytest.approx(expected)


def test_columns_and_residuals_say_the_same() -> None:
    data, candidates = random_data(12), random_candidates(12)
    chosen = (3, 2, 1)
    theta = np.random.default_rng(1).normal(size=FIXED + 4)
    for part, rest in enumerate(data.residuals(candidates, chosen, theta)):
        assert np.array_equal(data.tau[part], random_data(12).tau[part]), "untouched"
        for joint in range(data.n):
            model = data.columns(candidates, chosen, part, joint) @ theta
            assert rest[:, joint] == pytest.approx(data.tau[part][:, joint] - model)
