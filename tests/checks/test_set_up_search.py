"""Mount, zeros, units of positions and lags of torques, found by the fit that explains far more."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.checks.all_checks import look
from excite_cli.checks.foreign_runs import foreign_runs
from excite_cli.checks.result import Result
from excite_cli.checks.samples import samples_of
from excite_cli.checks.sentences import BELONG
from excite_cli.checks.set_up_search import _candidates
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import TextbookFit
from excite_cli.config.commented_yaml import with_values
from excite_cli.config.load import load_spec, spec_of
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.ground_truth import plant
from tests.simulation.arms import arm, played

SPEC: Spec = load_spec(Path(__file__).resolve().parents[2] / "configs" / "ur10.yaml")
WALL = np.array([0.0, -9.81, 0.0])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return arm()


@pytest.fixture(scope="module")
def sound(robot: Robot) -> Dataset:
    """With dry friction, and masses that are up to 20 % off."""
    sizes = [9.0, 9.0, 6.0, 2.0, 2.0, 1.0]
    rubs = [plant(kind_named("coulomb_friction"), (j,), x) for j, x in enumerate(sizes)]
    return played(robot, *rubs, torque_noise=0.01, inertia_error=0.2).dataset


def found(robot: Robot, data: Dataset, spec: Spec = SPEC) -> list[Result]:
    processing = choose_processing(data.runs, spec.measurement.filter)
    return look(robot, data.runs, prepare_all(data.runs, processing), spec)


def changed(data: Dataset, change: Callable[[Run], Run]) -> Dataset:
    return replace(data, runs=tuple(map(change, data.runs)))


def at(j: int, n: int = 6) -> Array:
    return np.asarray(np.arange(n) == j, float)


def test_sound_data(robot: Robot, sound: Dataset) -> None:
    assert found(robot, sound) == []


def test_a_robot_on_a_wall_whose_config_stands(robot: Robot, sound: Dataset) -> None:
    """Seen from the other side: the robot stands, and its config hangs it on a wall."""
    (result,) = found(robot.with_gravity(WALL), sound)
    assert (result.kind, result.status) == ("mount", "fault")
    roll, pitch, yaw = result.settings["robot.base_orientation"]
    assert (roll, pitch, yaw) == pytest.approx((-np.pi / 2, 0.0, 0.0), abs=1e-3)


def test_a_leaning_table_is_a_doubt_or_a_fault_with_its_angle(robot: Robot, sound: Dataset) -> None:
    lean = np.radians(12.0)
    tilted = robot.with_gravity(np.array([np.sin(lean), 0.0, -np.cos(lean)]) * 9.81)
    (result,) = found(tilted, sound)
    assert result.kind == "mount"
    _, pitch, _ = result.settings["robot.base_orientation"]
    assert abs(pitch) == pytest.approx(lean, abs=np.radians(0.3))


def test_a_robot_under_a_ceiling_is_not_one_with_zeros_and_signs_that_are_off(
    robot: Robot, sound: Dataset
) -> None:
    """The shoulder half a turn off, and two signs turned, explain as much, in three steps."""
    (result,) = found(robot.with_gravity(np.array([0.0, 0.0, 9.81])), sound)
    assert (result.kind, result.status) == ("mount", "fault")


def test_a_run_that_shows_a_wrong_order_more_is_not_foreign(robot: Robot, sound: Dataset) -> None:
    """Where only the last joint moves, whose column is right, an exchange of others is not seen."""
    (first,) = sound.runs
    dynamics, noise = InverseDynamics(robot), np.random.default_rng(3)

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
    assert foreign_runs(robot, prepared)
    assert {each.kind for each in found(robot, data)} == {"order"}


@pytest.mark.parametrize("off", [np.pi / 2, np.pi, 0.7])
def test_the_zero_of_a_joint(robot: Robot, sound: Dataset, off: float) -> None:
    shifted = changed(sound, lambda run: replace(run, q=run.q + off * at(2)))
    (result,) = found(robot, shifted)
    assert (result.kind, result.joints) == ("zero", ("elbow_joint",))
    written = result.settings["measurement.offset"]["elbow_joint"]
    wrong = (written + off + np.pi) % (2 * np.pi) - np.pi
    assert wrong == pytest.approx(0.0, abs=0.05)
    declared = SPEC.measurement.model_copy(update={"offset": {"elbow_joint": 0.0}})
    trusting = SPEC.model_copy(update={"measurement": declared})
    # what is declared is taken as it is
    assert all(each.kind != "zero" for each in found(robot, shifted, trusting))


def test_counts_of_another_encoder(robot: Robot, sound: Dataset) -> None:
    halved = changed(sound, lambda run: replace(run, q=0.5 * run.q, dq=None))
    (result,) = found(robot, halved)
    assert result.kind == "angle"
    assert result.settings["measurement.angle"] == pytest.approx(2.0)


@pytest.mark.parametrize("late", [0.06, -0.06])
def test_torques_behind_their_positions(robot: Robot, sound: Dataset, late: float) -> None:
    def shift(run: Run) -> Run:
        tau = [np.interp(run.t - late, run.t, column) for column in run.tau.T]
        return replace(run, tau=np.column_stack(tau))

    (result,) = found(robot, changed(sound, shift))
    assert result.kind == "torque_lag"
    assert result.settings["measurement.torque_lag"] == pytest.approx(late, abs=0.016)


def test_a_turned_position_turns_what_the_config_adds(robot: Robot, sound: Dataset) -> None:
    """The file's -q - 0.4 is read with an offset of 0.4: right are -1 and -0.4."""
    declared = SPEC.measurement.model_copy(update={"offset": {"elbow_joint": 0.4}})
    spec = SPEC.model_copy(update={"measurement": declared})
    turned = changed(sound, lambda run: replace(run, q=run.q * (1 - 2 * at(2)), dq=None))
    (result,) = found(robot, turned, spec)
    assert result.kind == "position_sign"
    assert result.settings["measurement.position_sign"] == {"elbow_joint": -1}
    assert result.settings["measurement.offset"] == {"elbow_joint": -0.4}


def test_two_mistakes_at_once(robot: Robot, sound: Dataset) -> None:
    both = changed(
        sound, lambda run: replace(run, q=run.q + np.pi / 2 * at(1), tau=run.tau * (1 - 2 * at(2)))
    )
    kinds = {(each.kind, each.joints) for each in found(robot, both)}
    assert ("zero", ("shoulder_lift_joint",)) in kinds
    assert ("torque_sign", ("elbow_joint",)) in kinds


def test_the_fit_against_least_squares_of_its_own_rows(robot: Robot, sound: Dataset) -> None:
    """Without a floor and with bodies that hardly bend, shares are those of plain least squares."""
    processing = choose_processing(sound.runs, SPEC.measurement.filter)
    samples = samples_of(prepare_all(sound.runs, processing), 200)
    fit = TextbookFit(robot, samples, floor=1e-9, loose=1e-6)
    explained = fit(Setup.as_declared(robot))
    assert explained.bent == pytest.approx(0.0, abs=1e-3)
    load = fit.columns(Setup.as_declared(robot)) @ fit.phi
    for j in range(robot.n):
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


def test_a_sign_that_is_declared_is_taken_and_doubted(robot: Robot, sound: Dataset) -> None:
    """Also where it is wrong: then nothing but the person can turn it."""
    turned = changed(sound, lambda run: replace(run, tau=run.tau * np.where(at(2), -1.0, 1.0)))
    (wrong,) = found(robot, turned)
    assert (wrong.kind, wrong.status) == ("torque_sign", "fault")
    declared = with_values(SPEC.model_dump(mode="json", exclude_unset=True),
                           {"measurement.sign": {"elbow_joint": 1}})  # fmt: skip
    (doubt,) = found(robot, turned, spec_of(declared))
    assert (doubt.name, doubt.status) == (BELONG, "doubt")
    assert doubt.joints == ("elbow_joint",)


@pytest.mark.parametrize("mass", [2.0, 5.0, 10.0])
def test_a_tool_is_no_unit_of_torques(robot: Robot, mass: float) -> None:
    """In units of which torques are next to nothing any bodies fit; a heavy hand is likelier."""
    load = plant(kind_named("payload"), (5,), mass)
    (result,) = found(robot, played(robot, load, torque_noise=0.01).dataset)
    assert (result.kind, result.status) == ("tool", "doubt")
    assert not result.settings


def test_coarse_positions_are_no_clock(robot: Robot, sound: Dataset) -> None:
    """Accelerations that are all rounding would be fewer if seconds were longer."""
    coarse = changed(sound, lambda run: replace(run, q=np.round(run.q, 2), dq=None))
    assert all(each.kind != "clock" for each in found(robot, coarse))


def test_what_is_trusted_is_said_not_to_be_judged(robot: Robot, sound: Dataset) -> None:
    values = {"measurement.trust": True}
    trusted = spec_of(with_values(SPEC.model_dump(mode="json", exclude_unset=True), values))
    (result,) = found(robot, sound, trusted)
    assert result.status == "ok"
    assert "not judged: measurement.trust is set" in result.evidence


def test_one_check_that_is_trusted_leaves_the_others(robot: Robot, sound: Dataset) -> None:
    both = changed(sound, lambda run: replace(run, q=run.q + np.pi / 2 * at(2)))
    hung = robot.with_gravity(np.array([0.0, 0.0, 9.81]))
    assert {each.kind for each in found(hung, both)} == {"mount", "zero"}
    values = {"measurement.trust": ["direction of gravity"]}
    spec = spec_of(with_values(SPEC.model_dump(mode="json", exclude_unset=True), values))
    assert "mount" not in {each.kind for each in found(hung, both, spec)}


def test_two_steps_of_one_check_are_one_row(robot: Robot, sound: Dataset) -> None:
    signs = np.where(at(1) + at(2) > 0, -1.0, 1.0)
    turned = changed(sound, lambda run: replace(run, tau=run.tau * signs))
    (result,) = found(robot, turned)
    assert result.kind == "torque_sign"
    assert result.settings == {"measurement.sign": {"shoulder_lift_joint": -1, "elbow_joint": -1}}
    assert result.evidence.count("As they are") == 1
    assert "As likely" not in result.evidence


def test_bodies_of_no_mass_are_unlikely(robot: Robot, sound: Dataset) -> None:
    """Beside torques in units of which there are 1e4 in one they fit, and anything with them.

    If the scale that all torques share could go to zero, that would cost 5 in L.
    """
    processing = choose_processing(sound.runs, SPEC.measurement.filter)
    fit = TextbookFit(robot, samples_of(prepare_all(sound.runs, processing), 300))
    declared = Setup.as_declared(robot)
    assert fit(replace(declared, unit=1e-4 * declared.unit)).bent > 15.0
    assert fit(declared).bent < 5.0


def test_what_puts_a_joint_beyond_its_limits_is_not_tried(robot: Robot, sound: Dataset) -> None:
    """Positions of other joints in the elbow's place, where the elbow cannot go."""
    data = changed(sound, lambda run: replace(run, q=run.q + 2.5 * at(2), dq=None))
    lower, upper = robot.limits.lower.copy(), robot.limits.upper.copy()
    lower[2], upper[2] = 1.5, 3.5
    narrow = replace(robot, limits=replace(robot.limits, lower=lower, upper=upper))
    prepared = prepare_all(data.runs, choose_processing(data.runs, SPEC.measurement.filter))

    def exchanges_of_the_elbow(of: Robot) -> list[str]:
        fit = TextbookFit(of, samples_of(prepared, 100))
        declared = Setup.as_declared(of)
        every = (each.alternative for each in _candidates(fit, fit, SPEC, declared, fit(declared)))
        return [x.variant for x in every if x.variant in ("positions", "columns") and 2 in x.joints]

    assert exchanges_of_the_elbow(robot)
    assert not exchanges_of_the_elbow(narrow)
