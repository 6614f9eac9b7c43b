"""Mount, zeros, units of positions and lags of torques, found by the fit that explains far more."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.checks.all_checks import look
from excite_cli.checks.check_result import CheckResult
from excite_cli.checks.foreign_runs import foreign_runs
from excite_cli.checks.sentences import BELONG
from excite_cli.checks.set_up_search import _candidates, beyond_limits
from excite_cli.checks.setup import Samples, Setup, samples_of
from excite_cli.checks.textbook_fit import TextbookFit
from excite_cli.config.commented_yaml import with_values
from excite_cli.config.load_spec import load_spec, spec_of
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.ground_truth import plant
from tests.simulation.arms import arm, played

pytestmark = pytest.mark.long

SPEC: Spec = load_spec(Path(__file__).resolve().parents[2] / "configs" / "ur10.yaml")
ROBOT = arm()
ELBOW, LIFT = "elbow_joint", "shoulder_lift_joint"
Change = Callable[[Run], Run]


@pytest.fixture(scope="module")
def sound() -> Dataset:
    """With dry friction, and masses that are up to 20 % off."""
    sizes = [9.0, 9.0, 6.0, 2.0, 2.0, 1.0]
    rubs = [plant(kind_named("coulomb_friction"), (j,), x) for j, x in enumerate(sizes)]
    return played(ROBOT, *rubs, torque_noise=0.01, inertia_error=0.2).dataset


def declaring(**keys: Any) -> Spec:
    """Of `measurement`."""
    values = {f"measurement.{key}": value for key, value in keys.items()}
    return spec_of(with_values(SPEC.model_dump(mode="json", exclude_unset=True), values))


def found(data: Dataset, spec: Spec = SPEC, robot: Robot = ROBOT) -> list[CheckResult]:
    processing = choose_processing(data.runs, spec.measurement.filter)
    return look(robot, data.runs, prepare_all(data.runs, processing), spec)


def changed(data: Dataset, change: Change) -> Dataset:
    return replace(data, runs=tuple(map(change, data.runs)))


def at(*joints: int) -> Array:
    return np.isin(np.arange(6), joints).astype(float)


def off(by: float, joint: int = 2) -> Change:
    return lambda run: replace(run, q=run.q + by * at(joint))


def turned(*joints: int) -> Change:
    return lambda run: replace(run, tau=run.tau * (1 - 2 * at(*joints)))


def late(by: float) -> Change:
    def shift(run: Run) -> Run:
        tau = [np.interp(run.t - by, run.t, column) for column in run.tau.T]
        return replace(run, tau=np.column_stack(tau))

    return shift


def test_sound_data(sound: Dataset) -> None:
    assert found(sound) == []
    (result,) = found(sound, declaring(trust=True))
    assert result.status == "ok"
    assert "not judged: measurement.trust is set" in result.evidence
    # Accelerations that are all rounding would be fewer if seconds were longer.
    coarse = changed(sound, lambda run: replace(run, q=np.round(run.q, 2), dq=None))
    assert all(each.kind != "clock" for each in found(coarse))


@pytest.fixture(scope="module")
def late_friction() -> Dataset:
    """Friction that follows a change of direction over 5 mrad, as gears have it."""
    sizes = [40.0, 40.0, 30.0, 8.0, 8.0, 6.0]
    dry, follows = kind_named("coulomb_friction"), kind_named("dahl_friction")
    rubs = [plant(dry, (j,), x) for j, x in enumerate(sizes)]
    rubs += [plant(follows, (j,), x, {"distance": 0.005}) for j, x in enumerate(sizes)]
    return played(ROBOT, *rubs, torque_noise=0.01, inertia_error=0.2).dataset


def test_friction_that_comes_late_is_no_torque_that_does(late_friction: Dataset) -> None:
    assert all(each.kind != "torque_lag" for each in found(late_friction))
    (result,) = (x for x in found(changed(late_friction, late(0.05))) if x.kind == "torque_lag")
    assert result.settings["measurement.torque_lag"] == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(
    ("gravity", "turn"),
    [
        ((0.0, -1.0, 0.0), (-np.pi / 2, 0.0, 0.0)),  # on a wall
        ((np.sin(0.21), 0.0, -np.cos(0.21)), (0.0, 0.21, 0.0)),  # on a table that leans
        # Under a ceiling: two signs and the shoulder half a turn off explain as much, in steps.
        ((0.0, 0.0, 1.0), None),
    ],
)
def test_a_robot_that_hangs_elsewhere_in_its_config(
    sound: Dataset, gravity: tuple[float, ...], turn: tuple[float, ...] | None
) -> None:
    """Seen from the other side: the robot stands."""
    (result,) = found(sound, robot=ROBOT.with_gravity(9.81 * np.array(gravity)))
    assert result.kind == "mount"
    if turn is None or turn[0]:
        assert result.status == "fault"
    if turn is not None:
        told = np.abs(result.settings["robot.base_orientation"])
        assert told == pytest.approx(np.abs(turn), abs=5e-3)


@pytest.mark.parametrize("by", [np.pi / 2, np.pi, 0.7, -0.115])
def test_the_zero_of_a_joint(sound: Dataset, by: float) -> None:
    shifted = changed(sound, off(by))
    (result,) = found(shifted)
    assert (result.kind, result.joints) == ("zero", (ELBOW,))
    wrong = result.settings["measurement.offset"][ELBOW] + by + np.pi
    assert wrong % (2 * np.pi) - np.pi == pytest.approx(0.0, abs=0.05)
    taken_as_it_is = found(shifted, declaring(offset={ELBOW: 0.0}))
    assert all(each.kind != "zero" for each in taken_as_it_is)


@pytest.mark.parametrize(
    ("change", "declared", "kind", "settings"),
    [
        (lambda run: replace(run, q=0.5 * run.q, dq=None), {}, "angle", {"angle": 2.0}),
        (late(0.06), {}, "torque_lag", {"torque_lag": 0.06}),
        (late(-0.06), {}, "torque_lag", {"torque_lag": -0.06}),
        # The file's -q - 0.4 is read with an offset of 0.4: right are -1 and -0.4.
        (
            lambda run: replace(run, q=run.q * (1 - 2 * at(2)), dq=None),
            {"offset": {ELBOW: 0.4}},
            "position_sign",
            {"position_sign": {ELBOW: -1}, "offset": {ELBOW: -0.4}},
        ),
        (turned(1, 2), {}, "torque_sign", {"sign": {LIFT: -1, ELBOW: -1}}),
    ],
)
def test_a_mistake_is_told_with_the_keys_that_mend_it(
    sound: Dataset, change: Change, declared: dict[str, Any], kind: str, settings: dict[str, Any]
) -> None:
    """Two steps of one check are one row."""
    (result,) = found(changed(sound, change), declaring(**declared) if declared else SPEC)
    assert result.kind == kind
    told = set(result.settings) - {"measurement.velocity_sign"}
    assert told == {f"measurement.{key}" for key in settings}
    for key, value in settings.items():
        assert result.settings[f"measurement.{key}"] == pytest.approx(value, abs=0.016)
    if kind == "torque_sign":
        assert result.evidence.count("As configured") == 1
        assert "As likely" not in result.evidence


def test_two_mistakes_at_once_of_which_one_may_be_trusted(sound: Dataset) -> None:
    both = changed(changed(sound, off(np.pi / 2, 1)), turned(2))
    kinds = {(each.kind, each.joints) for each in found(both)}
    assert {("zero", (LIFT,)), ("torque_sign", (ELBOW,))} <= kinds
    hung, shifted = ROBOT.with_gravity(np.array([0.0, 0.0, 9.81])), changed(sound, off(np.pi / 2))
    assert {each.kind for each in found(shifted, robot=hung)} == {"mount", "zero"}
    trusting = declaring(trust=["direction of gravity"])
    assert "mount" not in {each.kind for each in found(shifted, trusting, hung)}


def test_a_sign_that_is_declared_is_taken_and_doubted(sound: Dataset) -> None:
    """Also where it is wrong: then nothing but the person can turn it."""
    wrong = changed(sound, turned(2))
    (fault,) = found(wrong)
    assert (fault.kind, fault.status) == ("torque_sign", "fault")
    (doubt,) = found(wrong, declaring(sign={ELBOW: 1}))
    assert (doubt.name, doubt.status, doubt.joints) == (BELONG, "doubt", (ELBOW,))


@pytest.mark.parametrize("mass", [2.0, 5.0, 10.0])
def test_a_tool_is_no_unit_of_torques(mass: float) -> None:
    """In units of which torques are next to nothing any bodies fit; a heavy hand is likelier."""
    load = plant(kind_named("payload"), (5,), mass)
    (result,) = found(played(ROBOT, load, torque_noise=0.01).dataset)
    assert (result.kind, result.status) == ("tool", "doubt")
    assert not result.settings


def test_a_run_that_shows_a_wrong_order_more_is_not_foreign(sound: Dataset) -> None:
    """Where only the last joint moves, whose column is right, an exchange of others is not seen."""
    (first,) = sound.runs
    dynamics, noise = InverseDynamics(ROBOT), np.random.default_rng(3)

    def last_alone(run: Run) -> Run:
        q = np.where(np.arange(6) == 5, run.q, run.q[0])
        v, a = np.gradient(q, run.step, axis=0), np.zeros_like(q)
        tau = dynamics.torques(q, v, a) + 0.5 * np.sign(v)
        tau += 0.01 * noise.normal(size=tau.shape)
        return replace(run, name="last", q=q, dq=v, tau=tau)

    both = replace(sound, runs=(first, last_alone(first)))
    order = [1, 0, 3, 2, 4, 5]
    data = changed(both, lambda run: replace(run, q=run.q[:, order], dq=None))
    prepared = prepare_all(data.runs, choose_processing(data.runs, SPEC.measurement.filter))
    assert foreign_runs(ROBOT, prepared)
    assert {each.kind for each in found(data)} == {"order"}


def test_a_push_makes_no_other_robot_and_another_robots_torques_do(sound: Dataset) -> None:
    """Of a recording that does not fit for a tenth of its time, and of one that never does."""
    (first,) = sound.runs
    size, t = first.tau.std(axis=0), first.t - first.t[0]

    def other(tau: Array) -> list[PreparedRun]:
        runs = (first, replace(first, name="other", tau=tau))
        return prepare_all(runs, choose_processing(runs, SPEC.measurement.filter))

    pushed = (t > 0.3 * t[-1]) & (t < 0.4 * t[-1])
    push = other(first.tau + 5.0 * size * pushed[:, None])
    strange = other(first.tau[::-1].copy())
    setup = Setup.as_declared(ROBOT)
    shares = [
        TextbookFit(ROBOT, samples_of(run, 300))(setup).left for run in (push[1:], strange[1:])
    ]
    assert min(shares) > 0.4  # neither fits as a whole
    assert foreign_runs(ROBOT, push) == []
    (told,) = foreign_runs(ROBOT, strange)
    assert (told.runs, told.is_open) == ("other", True)


def test_bodies_of_no_mass_are_unlikely(sound: Dataset) -> None:
    """Beside torques in units of which there are 1e4 in one they fit, and anything with them.

    If the scale that all torques share could go to zero, that would cost 5 in L.
    """
    processing = choose_processing(sound.runs, SPEC.measurement.filter)
    fit = TextbookFit(ROBOT, samples_of(prepare_all(sound.runs, processing), 300))
    declared = Setup.as_declared(ROBOT)
    assert fit(replace(declared, unit=1e-4 * declared.unit)).bent > 15.0
    assert fit(declared).bent < 5.0
    # The fit against least squares of its own rows. Without a floor and with bodies that hardly
    # bend, shares are those of plain least squares.
    samples = samples_of(prepare_all(sound.runs, processing), 200)
    fit = TextbookFit(ROBOT, samples, floor=1e-9, loose=1e-6)
    explained = fit(Setup.as_declared(ROBOT))
    assert explained.bent == pytest.approx(0.0, abs=1e-3)
    load = fit.columns(Setup.as_declared(ROBOT)) @ fit.phi
    for j in range(ROBOT.n):
        rows = samples.moves[:, j] & samples.known[:, j]
        v, a, own = samples.v[rows, j], samples.a[rows, j], load[rows, j]
        columns = [v, np.sign(v), np.abs(own) * np.sign(v), a, np.ones(len(v))]
        x = np.column_stack([*columns, own])  # all torques may be off together by so little
        tau = samples.tau[rows, j]
        coefficients = np.linalg.lstsq(x[:, :5], tau - own, rcond=None)[0]
        rest = tau - own - x[:, :5] @ coefficients
        share = np.linalg.norm(rest) / np.linalg.norm(tau - tau.mean())
        if (coefficients[:4] >= 0.0).all():
            assert explained.shares[j] == pytest.approx(share, rel=1e-3)
        assert explained.shares[j] >= share * (1 - 1e-6)


def test_what_puts_a_joint_beyond_its_limits_is_not_tried(sound: Dataset) -> None:
    """Positions of other joints in the elbow's place, where the elbow cannot go."""
    data = changed(sound, lambda run: replace(run, q=run.q + 2.5 * at(2), dq=None))
    lower, upper = ROBOT.limits.lower.copy(), ROBOT.limits.upper.copy()
    lower[2], upper[2] = 1.5, 3.5
    narrow = replace(ROBOT, limits=replace(ROBOT.limits, lower=lower, upper=upper))
    prepared = prepare_all(data.runs, choose_processing(data.runs, SPEC.measurement.filter))

    def exchanges_of_the_elbow(of: Robot) -> list[str]:
        fit = TextbookFit(of, samples_of(prepared, 100))
        declared = Setup.as_declared(of)
        every = (each.alternative for each in _candidates(fit, fit, SPEC, declared, fit(declared)))
        return [x.variant for x in every if x.variant in ("positions", "columns") and 2 in x.joints]

    assert exchanges_of_the_elbow(ROBOT)
    assert not exchanges_of_the_elbow(narrow)


def resting(q: np.ndarray) -> Samples:
    none = np.zeros_like(q)
    every = np.ones(q.shape, bool)
    return Samples(q, none, none, none, none[:, :, None], none[None], every, every)


def test_beyond_by_a_tenth_of_the_range_but_for_whole_turns() -> None:
    upper = ROBOT.limits.upper
    q = np.zeros((3, ROBOT.n))
    q[0, 2] = upper[2] + 0.05 * (upper[2] - ROBOT.limits.lower[2])
    declared = Setup.as_declared(ROBOT)
    assert not beyond_limits(ROBOT, resting(q), declared).any()
    q[:, 2] += 2 * np.pi
    assert not beyond_limits(ROBOT, resting(q), declared).any()
    q[1, 2] += 1.5 * np.pi
    assert np.flatnonzero(beyond_limits(ROBOT, resting(q), declared)).tolist() == [2]
    assert not beyond_limits(ROBOT, resting(q), replace(declared, turn=0.1 * declared.turn)).any()
