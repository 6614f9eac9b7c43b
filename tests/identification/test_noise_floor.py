"""Planted noise comes back as the floor; what repeats does not count, what drifts does."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from excite_cli.config.data_spec import FilterSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.identify import identify
from excite_cli.identification.noise_floor import NoiseFloor, exact_period, noise_floor
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array
from tests.diagnosis.simulated_arm import ELBOW, ROBOT, planted, played
from tests.identification.synthetic import measured, torque
from tests.robot.random_robots import random_robot

RATE, PERIODS = 200.0, 4
WHOLE, BROKEN = 5.0, 4.9973  # s; the latter is no whole number of samples


def processing_of(runs: Sequence[Run], parallel: object = "auto") -> Processing:
    return choose_processing(runs, FilterSpec.model_validate({"parallel": parallel}))


def left_of_white_noise(processing: Processing, rate: float) -> float:
    """Share of white noise that SciPy's Gaussian filter with that -3 dB frequency leaves."""
    if processing.parallel_cutoff is None:
        return 1.0
    width = np.sqrt(np.log(2.0)) / (2 * np.pi * processing.parallel_cutoff) * rate
    white = np.random.default_rng(0).normal(size=400_000)
    return float(gaussian_filter1d(white, width).std())


def floor_of(runs: Sequence[Run], processing: Processing) -> NoiseFloor:
    found = noise_floor(runs, processing)
    assert found is not None
    return found


def simulated(period: float, count: int, noise: float, kind: str, value: float) -> Sequence[Run]:
    """Motions, four periods each, on an arm with an effect that the model knows nothing of."""
    effects = [planted(kind, ELBOW, value)]
    how = {"rate": RATE, "periods": PERIODS, "torque_noise": noise}
    return played(effects, range(1, count + 1), period, **how).runs


def waves(
    period: float, seconds: float, noise: float = 0.0, seed: int = 0, rate: float = RATE
) -> Run:
    """Two joints, harmonics of one period, a torque with dry friction, white noise on it."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    turn = 2 * np.pi / period * np.arange(1, 6)[:, None, None]
    size, start = rng.uniform(0.1, 0.4, (5, 1, 2)), rng.uniform(0, 6, (5, 1, 2))
    phase = turn * t[:, None] + start
    q = (size * np.sin(phase)).sum(axis=0)
    v = (size * turn * np.cos(phase)).sum(axis=0)
    tau = -20.0 * (size * turn**2 * np.sin(phase)).sum(axis=0) + 2.0 * np.tanh(v / 0.1)
    return Run("run", t, q, tau + noise * rng.normal(size=q.shape))


@pytest.mark.parametrize("period", [WHOLE, BROKEN])
def test_the_simulators_noise_comes_back_whatever_repeats(period: float) -> None:
    noise = 0.02
    runs = simulated(period, 2, noise, "coulomb_friction", 3.0)
    processing = processing_of(runs)
    recorded = np.mean([np.mean(run.tau**2, axis=0) for run in runs], axis=0)
    planted = noise * np.sqrt(recorded / (1 + noise**2))  # a share of the torque without noise
    found = floor_of(runs, processing)
    expected = planted * left_of_white_noise(processing, RATE)
    np.testing.assert_allclose(found.rms, expected, rtol=0.1)
    assert not found.noticed(ROBOT.joint_names)


def test_friction_that_drifts_raises_the_floor_of_its_joint_only() -> None:
    rate = -0.1  # N·m/s
    runs = simulated(WHOLE, 1, 1e-4, "friction_drift", rate)
    found = floor_of(runs, processing_of(runs))
    # Where the joint moves, periods differ by rate · period, one after the other.
    drift = abs(rate) * WHOLE * np.std(np.arange(PERIODS), ddof=1)
    assert found.rms[2] == pytest.approx(drift, rel=0.15)
    others = np.delete(found.rms, 2)
    assert (others < 0.1 * drift).all()


@pytest.mark.parametrize("parallel", ["auto", "none", 60.0])
@pytest.mark.parametrize("period", [WHOLE, BROKEN, 3.33712])
def test_any_filter_and_any_period(period: float, parallel: object) -> None:
    run = waves(period, PERIODS * period + 0.7, noise=1.0)
    processing = processing_of([run], parallel)
    found = floor_of([run], processing)
    expected = left_of_white_noise(processing, RATE)
    np.testing.assert_allclose(found.rms, expected, rtol=0.1)


def test_no_floor_without_two_periods() -> None:
    run = waves(WHOLE, 1.7 * WHOLE)
    assert noise_floor([run], processing_of([run])) is None
    robot = random_robot(3, joints=2)
    data = measured(robot, standard_parameters(robot), noise=0.1, seeds=(1, 2))
    assert noise_floor(data.runs, processing_of(data.runs)) is None
    # The period to a fraction of a sample.
    rng = np.random.default_rng(4)
    for period in (WHOLE, BROKEN, 3.33712):
        run = waves(period, 3.4 * period)
        q = run.q + 1e-4 * rng.normal(size=run.q.shape)
        known = np.ones(len(q), bool)
        assert exact_period(q, known) == pytest.approx(period * RATE, abs=0.01)
        known[300:500] = known[900:1000] = False
        q[~known] = 1e3
        assert exact_period(q, known) == pytest.approx(period * RATE, abs=0.01)
    assert exact_period(np.cumsum(rng.normal(size=(1000, 2)), axis=0), np.ones(1000, bool)) is None
    assert exact_period(np.zeros((1000, 2)), np.ones(1000, bool)) is None


def test_a_constant_drift_is_part_of_the_floor_to_the_digit() -> None:
    run = waves(WHOLE, PERIODS * WHOLE)
    drifting = replace(run, tau=run.tau + 0.3 * run.t[:, None])
    short = replace(processing_of([run]), rate=20.0)
    found, plain = floor_of([drifting], short), noise_floor([run], short)
    assert found is not None
    per_period = 0.3 * WHOLE
    assert (plain.rms < 1e-3 * per_period).all()
    assert found.rms == pytest.approx(per_period * np.sqrt(5 / 3), rel=0.02)
    # Runs are combined by their squares.
    quiet = waves(WHOLE, PERIODS * WHOLE, noise=0.2, seed=1)
    loud = waves(BROKEN, PERIODS * BROKEN, noise=1.0, seed=2)
    single = waves(WHOLE, 1.5 * WHOLE, noise=9.0, seed=3)  # not repeated: does not count
    processing = processing_of([quiet, loud])
    every = ([quiet], [loud], [quiet, single, loud])
    one, other, both = (floor_of(runs, processing).rms for runs in every)
    np.testing.assert_allclose(both, np.sqrt((one**2 + other**2) / 2), rtol=0.01)


@pytest.mark.parametrize("others", [0, 1])
def test_parts_of_a_run_say_what_the_run_says(others: int) -> None:
    """Held-out blocks leave gaps; of two runs, one is halved."""
    run = waves(BROKEN, PERIODS * BROKEN, noise=1.0)
    held_out = [replace(run, name=f"held_out_{k}") for k in range(others)]
    parts = split(Dataset(("a", "b"), (run, *held_out)))
    assert len(parts.training) == (2 if others else 4)
    processing = processing_of(parts.training)
    found = floor_of(parts.training, processing)
    whole = floor_of([run], processing)
    np.testing.assert_allclose(found.rms, whole.rms, rtol=1e-9 if others else 0.15)


def test_invalid_samples_do_not_count() -> None:
    run = waves(WHOLE, PERIODS * WHOLE, noise=1.0)
    bad = np.zeros(run.tau.shape, bool)
    bad[700:760, 0] = bad[2100:2103, 1] = True
    masked = replace(run, tau=np.where(bad, np.nan, run.tau), valid=~bad)
    processing = processing_of([run])
    found, all_of_it = floor_of([masked], processing), noise_floor([run], processing)
    assert found is not None
    np.testing.assert_allclose(found.rms, all_of_it.rms, rtol=0.03)
    counted = floor_of([replace(masked, tau=np.where(bad, 500.0, run.tau))], processing)
    np.testing.assert_array_equal(counted.rms, found.rms)
    silent = replace(run, valid=np.array([True, False]) & ~bad)
    one = floor_of([silent], processing)
    assert list(one.named(("a", "b"))) == ["a"]


def test_periods_that_begin_unevenly_are_told() -> None:
    """A pause of 4, 0 and 7 ms between periods: the torque differs because the motion is late."""
    run = waves(WHOLE, PERIODS * WHOLE, rate=1000.0)
    starts = np.repeat([0.0, 0.004, 0.004, 0.011], round(WHOLE * 1000.0))

    def late(x: Array) -> Array:
        return np.column_stack([np.interp(run.t - starts, run.t, column) for column in x.T])

    uneven = replace(run, q=late(run.q), tau=late(run.tau))
    found = floor_of([uneven], processing_of([uneven]))
    (told,) = found.noticed(("a", "b"))
    assert (told.kind, told.severity, told.joints) == ("uneven_periods", "note", ("a", "b"))
    np.testing.assert_allclose(found.misalignment, found.rms, rtol=0.2)


def test_a_complete_model_leaves_the_floor_and_an_incomplete_one_more() -> None:
    robot = random_robot(3, joints=2, prismatic=False)
    friction = [kind_named("viscous_friction")((j,)) for j in range(2)]
    runs = []
    for seed in (1, 2, 3):
        run = waves(WHOLE, PERIODS * WHOLE, seed=seed)
        v = np.gradient(run.q, run.step, axis=0)
        a = np.gradient(v, run.step, axis=0)
        values = np.array([0.6, 0.6])
        phi = standard_parameters(robot)
        tau = torque(robot, phi, friction, values, run.t, run.q, v, a, run.name)
        noise = 0.5 * np.random.default_rng(seed).normal(size=tau.shape)
        runs.append(replace(run, name=f"r{seed}", tau=tau + noise))
    data, base = Dataset(robot.joint_names, tuple(runs)), find_base_parameters(robot)

    def times(effects: str) -> Array:
        spec = parse_spec(f"robot: {{urdf: x.urdf}}\neffects: {effects}")
        found = identify(robot, base, data, spec)
        assert found.noise_floor is not None
        return np.array([found.error.rms[j] / found.noise_floor[j] for j in robot.joint_names])

    complete = times("[{kind: viscous_friction}]")
    assert complete == pytest.approx(1.0, abs=0.12)
    assert (times("[]") > 1.5 * complete).all()
