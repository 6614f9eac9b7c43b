"""A joint that is held still, as a MuJoCo robot with an encoder of small steps records it."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load import load_spec, parse_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification.identify import Identification, identify
from excite_cli.identification.least_squares import LinearFit
from excite_cli.identification.prior import inertial_prior
from excite_cli.identification.weak_directions import weak_directions
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, simulate
from excite_cli.trajectory.fourier import FourierTrajectory

SPEC = parse_spec("{robot: {urdf: x}, identification: {consistent: false}}")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def played(robot: Robot, still: int | None) -> Simulation:
    """Two motions of which joint `still` has no part."""
    motions = []
    for number, name in enumerate("ab"):
        trajectory = FourierTrajectory(4, 2 * np.pi / 6.0)
        lower, upper = robot.limits.ranges()
        shape = (trajectory.n_coefficients, robot.n)
        drawn = np.random.default_rng(number).normal(size=shape)
        coefficients = 0.05 * (upper - lower) * drawn
        coefficients[-1] = 0.3
        if still is not None:
            coefficients[:-1, still] = 0.0
        motions.append(PlannedMotion(name, trajectory, coefficients))
    settings = SimulationSettings(rate=250.0, inertia_error=0.1, encoder=1e-5)
    return simulate(robot, motions, settings)


@pytest.fixture(scope="module")
def held(robot: Robot) -> Simulation:
    return played(robot, still=1)


def fitted(robot: Robot, base: BaseParameters, data: Dataset, spec: Spec = SPEC) -> Identification:
    return identify(robot, base, data, spec)


def without_friction() -> Spec:
    return SPEC.model_copy(update={"effects": ()})


def test_what_a_joint_at_rest_does_not_show_is_kept(
    robot: Robot, base: BaseParameters, held: Simulation
) -> None:
    found = fitted(robot, base, held.dataset, without_friction())
    still = robot.joint_names[1]
    # 10 % is what the URDF is off; fitted freely, noise alone made this many times the torque.
    assert found.error.relative[still] < 0.2
    assert found.error.mean_relative < 0.1
    usual = np.sqrt(np.square(base.mapping) @ np.square(
        inertial_prior(robot, standard_parameters(robot), 1.0).std
    ))  # fmt: skip
    off = np.abs(found.fit.base_values - base.mapping @ held.truth.phi)
    assert (off < usual).all()
    told = {finding.kind: finding for finding in found.findings}
    assert told["still"].text.startswith(f"{still}: stands still in all of the data")
    assert told["still"].joints == (still,)
    assert f"{len(found.fit.kept)} of {base.rank} base parameters hardly show" in told["kept"].text
    kept = [found.fit.names.index(name) for name in found.fit.kept]
    assert kept
    assert not found.fit.identifiable[kept].any()


def test_where_all_joints_move_everything_is_fitted(robot: Robot, base: BaseParameters) -> None:
    moved = played(robot, still=None)
    found = fitted(robot, base, moved.dataset, without_friction())
    assert found.fit.kept == ()
    assert not {"still", "kept"} & {finding.kind for finding in found.findings}
    truth = base.mapping @ moved.truth.phi
    assert np.abs(found.fit.base_values - truth).max() < 0.02 * np.abs(truth).max()


def test_a_diagnosis_keeps_to_the_urdf_too(
    robot: Robot, base: BaseParameters, held: Simulation
) -> None:
    found = diagnose(robot, base, held.dataset, without_friction())
    assert found.after.relative[robot.joint_names[1]] < 0.5
    assert "still" in {finding.kind for finding in found.findings}


def linear(values: Array, deviations: Array) -> LinearFit:
    n = len(values)
    return LinearFit(
        values, np.diag(deviations**2), np.isfinite(deviations), np.ones(1), np.eye(n + 1),
        np.ones(1, int), 1.0,
    )  # fmt: skip


def test_which_directions_are_weak(robot: Robot, base: BaseParameters) -> None:
    cad = standard_parameters(robot)
    prior = inertial_prior(robot, cad, 1.0)
    values = base.mapping @ cad
    usual = np.sqrt(np.square(base.mapping) @ np.square(prior.std))
    sharp = linear(values, 1e-3 * usual)
    assert len(weak_directions(sharp, base, prior).rows) == 0
    blurred = replace(sharp, covariance=sharp.covariance.copy())
    blurred.covariance[2, 2] = (1e4 * usual[2]) ** 2
    found = weak_directions(blurred, base, prior)
    assert len(found.rows) == 1
    assert np.flatnonzero(found.deviations > 1.0).tolist() == [2]
    # The row lets the parameter stand where the URDF has it, if the others do.
    assert found.rows[0, :-1] @ values == pytest.approx(found.rows[0, -1], abs=1e-9)


def test_what_the_data_say_for_sure_is_not_overruled(robot: Robot, base: BaseParameters) -> None:
    """A placeholder in the URDF is off by many times its size; so is noise, and farther still."""
    prior = inertial_prior(robot, standard_parameters(robot), 1.0)
    usual = np.sqrt(np.square(base.mapping) @ np.square(prior.std))
    for factor, deviation, weak in ((100.0, 3.0, 0), (5.0, 3.0, 1), (1e6, 3.0, 1)):
        values = base.mapping @ standard_parameters(robot)
        deviations = 1e-3 * usual
        values[2] += factor * usual[2]
        deviations[2] = deviation * usual[2]
        found = weak_directions(linear(values, deviations), base, prior)
        assert len(found.rows) == weak, factor


def test_a_robot_without_masses_is_fitted_freely(robot: Robot) -> None:
    assert not inertial_prior(robot, np.zeros(10 * robot.n_bodies), 1.0).known
    assert inertial_prior(robot, standard_parameters(robot), 1.0).known
