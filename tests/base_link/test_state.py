"""How a base moved, from an inertial unit: accelerations and turns come back, drifts do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from excite_cli.base_link.state import base_state, denoised
from excite_cli.base_link.wrench_rows import with_base
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.wrench_spec import BaseStateSpec
from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Robot
from tests.base_link.stander import FEET, Array, Swayed, stander, swayed

STEP = 0.005
UNIT = {"imu": {"link": "unit"}}


@pytest.fixture(scope="module")
def log() -> Swayed:
    return swayed(samples=1600, step=STEP)


def accelerations(q: Array) -> Array:
    return np.gradient(np.gradient(q, STEP, axis=0), STEP, axis=0)[100:-100]


def test_a_unit_tells_how_the_base_accelerates_and_turns(robot: Robot, log: Swayed) -> None:
    found = base_state(robot, log.run, BaseStateSpec.model_validate(UNIT))
    truth = accelerations(log.q[:, :6])
    rms = np.sqrt(np.mean((accelerations(found.q) - truth) ** 2, axis=0))
    assert (rms < 0.05 * np.sqrt(np.mean(truth**2, axis=0))).all()
    # What is slower than the polynomials is not known, and a base that stands has none of it.
    turned = np.abs(found.q - log.q[:, :6])[:, 3:].max(axis=0)
    assert (turned < 0.06 * np.abs(log.q[:, 3:6]).max(axis=0)).all()
    assert found.lean is not None
    assert np.linalg.norm(found.lean) < np.radians(0.1)


def test_constant_errors_of_the_unit_do_no_harm(robot: Robot, log: Swayed) -> None:
    biased = dict(log.run.extra)
    biased["gyroscope"] = biased["gyroscope"] + [0.02, -0.03, 0.01]
    biased["accelerometer"] = biased["accelerometer"] + [0.1, -0.05, 0.08]
    spec = BaseStateSpec.model_validate(UNIT)
    plain, found = (
        base_state(robot, replace(log.run, extra=extra), spec).q
        for extra in (log.run.extra, biased)
    )
    assert np.abs(accelerations(found) - accelerations(plain)).max() < 0.02


def test_gravity_from_elsewhere_is_a_base_that_leans(robot: Robot, log: Swayed) -> None:
    """The unit, and all that stands, turned by 3° of pitch: gravity turns the other way in it."""
    tilt = Rotation.from_euler("y", 3.0, degrees=True)
    axes = Rotation.from_euler("xyz", [0.4, 0.3, -1.0])
    gravity = np.array([0.0, 0.0, 9.81])
    turned = Rotation.from_euler("ZYX", log.q[:, 3:6])
    change = turned.inv().apply(tilt.inv().apply(gravity) - gravity)
    extra = dict(log.run.extra)
    extra["accelerometer"] = extra["accelerometer"] + axes.inv().apply(change)
    run = replace(log.run, extra=extra)
    found = base_state(robot, run, BaseStateSpec.model_validate(UNIT))
    assert found.lean == pytest.approx([0.0, np.radians(3.0), 0.0], abs=np.radians(0.1))
    spec = MeasurementSpec.model_validate(
        {"base": UNIT, "wrench": [{"channel": foot, "link": foot} for foot in FEET]}
    )
    _, told = with_base(robot, Dataset(robot.joint_names[6:], (run,)), spec, True)
    assert [each.kind for each in told] == ["leaning"]
    assert "leans by 3.0°" in told[0].text


def test_a_pose_may_be_of_any_origin(robot: Robot, log: Swayed) -> None:
    """A base of which nothing is said stands."""
    moved = {"pose": log.run.extra["pose"] + [5.0, -3.0, 1.0, 0, 0, 0, 0]}
    found = base_state(robot, replace(log.run, extra=moved), BaseStateSpec(pose="pose")).q
    assert found == pytest.approx(log.q[:, :6], abs=1e-9)
    still = base_state(robot, log.run, BaseStateSpec())
    assert not still.q.any()
    assert still.lean is None


def test_a_base_on_its_side_has_axes_of_its_own(tmp_path: Path, log: Swayed) -> None:
    """`base_orientation` is where it stands: coordinates count from there, along its axes."""
    lying = stander(tmp_path, base_orientation=(0.0, 1.5707963267948966, 0.0))
    reference = Rotation.from_euler("xyz", [0.0, np.pi / 2, 0.0])
    pose = log.run.extra["pose"]
    turned = reference * Rotation.from_quat(pose[:, 3:])
    placed = np.column_stack([reference.apply(pose[:, :3]), turned.as_quat()])
    run = replace(log.run, extra={"pose": placed})
    assert base_state(lying, run, BaseStateSpec(pose="pose")).q == pytest.approx(
        log.q[:, :6], abs=1e-9
    )
    with pytest.raises(FileError, match=r"pitches by 1.5\d rad from robot.base_orientation"):
        base_state(lying, log.run, BaseStateSpec(pose="pose"))


PERIOD = 0.002
NOISE = 0.02


def motion(rng: np.random.Generator, seconds: float = 30.0) -> Array:
    """Accelerations (T, 3) of a few frequencies below 1.5 Hz, of the size of the noise."""
    t = np.arange(0.0, seconds, PERIOD)
    waves = [np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) for f in (0.3, 0.7, 1.3)]
    return np.asarray(0.01 * sum(waves) + rng.uniform(-1, 1, 3))


def slopes(y: Array, x: Array) -> Array:
    y, x = y - y.mean(axis=0), x - x.mean(axis=0)
    return np.asarray((x * y).sum(axis=0) / np.square(x).sum(axis=0))


@pytest.mark.parametrize("seed", range(5))
def test_sizes_fitted_to_the_estimate_are_not_too_small(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = motion(rng)
    seen = truth + NOISE * rng.normal(size=truth.shape)
    found = denoised(seen, PERIOD)
    assert (slopes(truth, seen) < 0.7).all()  # what noise does to a size
    # Noise stays within half a hertz of what moves: 2/250 of it, 2 % of the signal's energy.
    assert slopes(truth, found) == pytest.approx(np.ones(3), abs=0.04)
    assert found.mean(axis=0) == pytest.approx(seen.mean(axis=0))


def test_a_clean_signal_stays_and_noise_becomes_little() -> None:
    truth = motion(np.random.default_rng(3))
    assert np.abs(denoised(truth, PERIOD) - truth).max() < 1e-4
    noise = NOISE * np.random.default_rng(4).normal(size=(15000, 6))
    assert denoised(noise, PERIOD).std() < 0.1 * NOISE
    assert np.isfinite(denoised(noise[:20], PERIOD)).all(), "a short recording is taken"


def test_what_cannot_be_asked_is_refused(robot: Robot, log: Swayed) -> None:
    spec = BaseStateSpec.model_validate({"imu": {"link": "left_hand"}})
    with pytest.raises(ConfigError, match="'left_hand' moves in the base, with joint 'left_elbow'"):
        base_state(robot, log.run, spec)
    with pytest.raises(ValueError, match="give pose or imu, not both"):
        BaseStateSpec.model_validate({"pose": "pose", **UNIT})
