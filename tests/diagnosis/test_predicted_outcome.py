"""What a diagnosis is expected to make of an effect: named, told apart, taken up by inertias."""

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.power import power_of, price, sizes_shown
from excite_cli.diagnosis.predicted_outcome import predict_outcome, rows_of_fit
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Run
from excite_cli.trajectory.fade import Segment
from tests.excitation.smoke import drawn, smoke, stacked
from tests.excitation.smoke import prediction_of as of

NOISE = 0.02


@pytest.fixture(scope="module")
def problem() -> Problem:
    return smoke("criterion.kind=predicted_torque")


def effect_of(problem: Problem, kind: str, joint: str) -> Effect:
    place = (problem.robot.joint_names.index(joint),)
    effects = of(problem).extension.effects
    return next(each for each in effects if each.kind == kind and each.joints == place)


def test_it_is_named_as_often_as_its_power_says(problem: Problem) -> None:
    stack, kind = stacked(problem, 1), "load_dependent_friction"
    effect = effect_of(problem, kind, "elbow")
    shown = sizes_shown(of(problem), stack, 0.01, power=0.8)
    size = next(it.size for it in shown if (it.kind, it.joints) == (kind, ("elbow",)))
    for times in (0.3, 1.0, 1.5):
        found = predict_outcome(
            of(problem), stack, None, 0.01, effect, np.array([times * size]), NOISE
        )
        same = power_of(of(problem), stack, 0.01, kind, times * size)
        own = next(it.power for it in same if it.joints == ("elbow",))
        assert found.named == pytest.approx(own)


def test_what_is_small_is_not_named_however_sure(problem: Problem) -> None:
    stack, effect = stacked(problem, 1), effect_of(problem, "load_dependent_friction", "elbow")
    values = np.array([0.02])
    assert predict_outcome(of(problem), stack, None, 0.01, effect, values, NOISE).named > 0.9
    assert (
        predict_outcome(of(problem), stack, None, 0.01, effect, values, 1e-3 * rules.SMALLEST).named
        == 0.0
    )


def test_the_likelier_of_two_is_preferred_as_often_as_told(problem: Problem) -> None:
    """Drawn data of a robot that has the one: which of the two saves more χ² beyond its price?"""
    prediction, rng = of(problem), np.random.default_rng(5)
    block = problem.objective().block(drawn(problem, 0.3, 1))
    stack = Stack.empty(problem.columns).with_rows(block)
    effect, values = effect_of(problem, "load_dependent_friction", "elbow"), np.array([1e-3])
    for _ in range(30):
        found = predict_outcome(prediction, stack, None, 0.01, effect, values, 1.0)
        if found.apart > 0.8:
            break
        values = 1.3 * values
    assert 0.6 < found.apart < 0.95
    assert found.rival is not None
    rival = effect_of(problem, found.rival[0], *found.rival[1])
    p, d = (
        prediction.first_columns[prediction.extension.effects.index(e)] for e in (effect, rival)
    )
    textbook = ("viscous_friction", "coulomb_friction", "torque_offset", "armature")
    beside = [*range(prediction.rank)]
    beside += [
        int(first)
        for first, each in zip(prediction.first_columns, prediction.extension.effects, strict=True)
        if each.kind in textbook and each != effect
    ]
    prior = np.eye(len(beside))[prediction.rank :]
    fixed = np.vstack([block[:, beside], prior])
    both = [np.append(block[:, each], np.zeros(len(prior))) for each in (p, d)]
    q, _ = np.linalg.qr(fixed)
    seen = [each - q @ (q.T @ each) for each in both]
    size = values[0] / prediction.extension.scales[p - prediction.rank]
    dearer = price(type(rival), 0.01) - price(type(effect), 0.01)
    preferred = 0
    for _ in range(1000):
        rows = size * seen[0] + rng.normal(size=len(fixed))
        saved = [(each @ rows) ** 2 / (each @ each) for each in seen]
        preferred += saved[0] + dearer > saved[1]
    assert preferred / 1000 == pytest.approx(found.apart, abs=0.05)


def test_inertias_take_up_what_no_motion_separates_from_them(problem: Problem) -> None:
    effect = effect_of(problem, "armature", "shoulder_yaw")
    found = predict_outcome(
        of(problem), stacked(problem, 1), None, 0.01, effect, np.array([1.0]), NOISE
    )
    assert found.absorbed
    assert found.named == 0.0
    other = effect_of(problem, "armature", "elbow")
    assert not predict_outcome(
        of(problem), stacked(problem, 1), None, 0.01, other, np.array([1.0]), NOISE
    ).absorbed


def test_what_shows_on_no_motion_is_not_named(problem: Problem) -> None:
    effect = kind_named("encoder_offset")((0,))  # gravity does not turn about it
    assert effect not in of(problem).extension.effects
    assert (
        predict_outcome(
            of(problem), stacked(problem, 1), None, 0.01, effect, np.ones(1), NOISE
        ).named
        == 0.0
    )


def test_what_shows_in_few_held_out_blocks_is_not_confirmed(problem: Problem) -> None:
    """The same energy in twelve blocks and in two: of these a draw may have none."""
    block = problem.objective().block(drawn(problem, 0.3, 1))
    stack, effect = stacked(problem, 1), effect_of(problem, "load_dependent_friction", "elbow")
    whole = block.reshape(12, -1, block.shape[1])
    few = np.zeros_like(whole)
    few[:2] = np.sqrt(6.0) * whole[:2]
    of_whole, of_few, of_none = (
        predict_outcome(of(problem), stack, each, 0.01, effect, np.array([0.2]), NOISE).named
        for each in (whole, few, 0.0 * whole)
    )
    assert of_whole > 0.95
    assert of_few < 0.6
    assert of_none < 0.05


def test_a_fit_leaves_out_what_shows_about_reversals_alone(problem: Problem) -> None:
    """Dry friction is whole where a fit has rows; of Stribeck friction little is left there."""
    motion = Segment("motion_1", problem.trajectory, drawn(problem, 0.3, 1))
    t = np.arange(0.0, problem.trajectory.duration, 0.002)
    q = motion.trajectory.states(t, motion.coefficients)[0]
    recording = Run("motion_1", t, q, np.zeros_like(q))
    run = prepare(recording, choose_processing([recording], FilterSpec()))
    rows = rows_of_fit(problem, motion, run).reshape(len(run.tau_fit), problem.robot.n, -1)
    prediction = of(problem)
    joint = problem.robot.joint_names.index("elbow")

    def torque(kind: str) -> np.ndarray:
        """Of one unit of it."""
        at = prediction.extension.effects.index(effect_of(problem, kind, "elbow"))
        first = prediction.first_columns[at]
        size = prediction.extension.scales[first - prediction.rank]
        return np.abs(rows[:, joint, first]) / size

    dry, narrow = torque("coulomb_friction"), torque("stribeck_friction")
    assert 0.0 < narrow.max() < 0.12 * dry.max(), "0.16 with the instants about reversals"


def test_a_share_near_the_smallest_is_named_as_often_as_inertias_let_it(problem: Problem) -> None:
    stack, effect = stacked(problem, 1), effect_of(problem, "load_dependent_friction", "elbow")

    def named(noise: float, unsure: float) -> float:
        values = np.array([0.02])
        return predict_outcome(of(problem), stack, None, 0.01, effect, values, noise, unsure).named

    low, high = 1e-6, 1.0
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if named(middle, 0.0) > 0.0 else (middle, high)
    sure = named(1.1 * high, 0.0)
    assert named(high, 0.2) == pytest.approx(0.5 * sure, abs=0.01)
    assert named(high * np.exp(0.2), 0.2) == pytest.approx(0.841 * sure, abs=0.01)
    assert named(high * np.exp(-1.0), 0.2) == 0.0


def test_what_the_textbook_has_is_confirmed_from_two_deviations_on(problem: Problem) -> None:
    """Whatever it costs, but for what is too small to stay in the model."""
    effect = effect_of(problem, "viscous_friction", "elbow")
    stack = stacked(problem, 1)
    powers = power_of(of(problem), stack, 0.01, "viscous_friction", 1.0)
    two = 2.0 / next(it.times for it in powers if it.joints == ("elbow",))
    large, small = (
        predict_outcome(of(problem), stack, None, 0.01, effect, np.array([two]), noise)
        for noise in (1.0, 1e-2 * rules.MATTERS)
    )
    assert large.named == pytest.approx(0.5, abs=0.01)
    assert small.named < 0.1
