"""Torques of another unit, without gravity, or of another run, a clock; and sound recordings."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.loading import Case, load_data
from excite_cli.checks.all_checks import check_dataset
from excite_cli.config.load_spec import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.robot.model import Array
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.simulate import simulate
from tests.simulation.arms import IDEAL, arm, motion

pytestmark = pytest.mark.long

SPEC: Spec = load_spec(Path(__file__).resolve().parents[2] / "configs" / "ur10.yaml")
FRICTION = [10.0, 15.0, 8.0, 3.0, 2.0, 1.0]  # N·m
SHOULDER, ELBOW = "shoulder_lift_joint", "elbow_joint"
ROBOT = arm()


@pytest.fixture(scope="module")
def sound() -> Dataset:
    """Three motions of an arm whose masses are 10 to 30 % off, with dry friction; one held out."""
    rubbing = [plant(kind_named("coulomb_friction"), (j,), x) for j, x in enumerate(FRICTION)]
    motions = [motion(ROBOT, seed, f"run_{seed}") for seed in (1, 2, 3)]
    settings = replace(IDEAL, rate=200.0, torque_noise=0.01, inertia_error=0.2)
    return simulate(ROBOT, motions, settings, rubbing).dataset


def told(data: Dataset, **declared: object) -> tuple[Finding, ...]:
    measured = SPEC.measurement.model_copy(update=declared)
    return check_dataset(ROBOT, data, SPEC.model_copy(update={"measurement": measured}))


def with_torque(data: Dataset, change: Callable[[Run], Array]) -> Dataset:
    runs = tuple(replace(run, tau=change(run), extra={}) for run in data.runs)
    return replace(data, runs=runs)


def without_gravity(run: Run) -> Array:
    rest = np.zeros_like(run.q)
    return run.tau - InverseDynamics(ROBOT).torques(run.q, rest, rest)


def test_one_torque_in_another_unit_and_sound_ones(sound: Dataset) -> None:
    assert told(sound) == ()
    halved = with_torque(sound, lambda run: 0.5 * run.tau)  # masses may be off by as much
    assert told(halved) == ()
    # One torque in another unit.
    scale = np.where(np.arange(6) == 2, 1e3, 1.0)
    with pytest.raises(FileError, match=f"torques of {ELBOW} are 1e.03 times") as found:
        told(with_torque(sound, lambda run: scale * run.tau))
    assert "shoulder_lift_joint: 1, elbow_joint: 0.001, wrist_1_joint: 1" in str(found.value)


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "mNm"), (1e-2, "100")])
def test_all_torques_in_another_unit(sound: Dataset, factor: float, unit: str) -> None:
    wrong = with_torque(sound, lambda run: factor * run.tau)
    with pytest.raises(FileError, match="torques of all joints are") as found:
        told(wrong)
    assert f"measurement.torque_unit: {unit})" in str(found.value)
    assert "measurement.torque: motor" in str(found.value)
    assert told(wrong, trust=True) == ()


def test_another_unit_shows_beside_friction_that_is_more_than_the_weight(sound: Dataset) -> None:
    """As on a robot that rubs: half of the torque is weight, in mN·m or as it is."""
    names = ROBOT.joint_names
    j = names.index(SHOULDER)
    weight = np.concatenate([run.tau[:, j] for run in sound.runs]).std()
    rubs = with_torque(
        sound, lambda run: run.tau + 2.5 * weight * np.sign(run.dq) * (np.arange(len(names)) == j)
    )
    assert told(rubs) == ()
    scaled = with_torque(rubs, lambda run: np.where(np.arange(len(names)) == j, 1e3, 1.0) * run.tau)
    (found,) = told(scaled)
    assert (found.kind, found.severity, found.joints) == ("torque_scale", "warning", (SHOULDER,))
    assert "shoulder_lift_joint: 0.001, elbow_joint: 1" in found.text


def test_gravity_that_is_subtracted_is_told_and_its_key_adds_it(
    sound: Dataset, tmp_path: Path
) -> None:
    lost = with_torque(sound, lambda run: without_gravity(run))
    with pytest.raises(FileError, match="gravity seems to be subtracted") as found:
        told(lost)
    assert "measurement.gravity: subtracted" in str(found.value)
    write_dataset(tmp_path / "log.h5", lost, {})
    measured = SPEC.measurement.model_copy(update={"gravity": "subtracted"})
    spec = SPEC.model_copy(update={"measurement": measured})
    back = load_data(Case(spec, tmp_path, ROBOT), tmp_path / "log.h5", tell=lambda note: None)
    for run, known in zip(back.runs, sound.runs, strict=True):
        np.testing.assert_allclose(run.tau, known.tau, atol=1e-9)
    assert check_dataset(ROBOT, back, spec) == ()


def test_torques_of_another_run_are_told_with_the_run_that_they_belong_to(sound: Dataset) -> None:
    first, second, third = sound.runs
    mixed = replace(sound, runs=(replace(first, tau=second.tau), second, third))
    with pytest.raises(FileError, match=r"torques of run_1 .* fit the motion of run_2"):
        told(mixed)
    assert told(mixed, trust=True) == ()


def test_a_clock_that_is_off_is_seen_by_gravity_where_there_are_no_speeds() -> None:
    """Of an arm without friction; that of `sound` is half of the torque of its wrists."""
    motions = [motion(ROBOT, seed, f"run_{seed}") for seed in (1, 2)]
    data = simulate(ROBOT, motions, replace(IDEAL, rate=200.0, torque_noise=0.01)).dataset
    runs = [replace(run, t=0.9 * run.t, dq=None) for run in data.runs]
    (found,) = told(replace(data, runs=tuple(runs)))
    assert (found.kind, found.severity) == ("clock", "warning")
    key = float(found.text.split("measurement.clock: ")[1].split(")")[0])
    assert key == pytest.approx(1 / 0.9, rel=0.02)
    right = tuple(replace(run, t=key * run.t) for run in runs)
    assert told(replace(data, runs=right)) == ()
    assert told(replace(data, runs=tuple(runs)), trust=True) == ()
