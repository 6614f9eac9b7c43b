"""A stored model in use: the torque of the error table, exact slopes, friction, refusals."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from excite_cli import Model, read_fit
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.effects.sign import sign_of_width
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.gradient_check import fourth_order_differences
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.stored_model import StoredModel
from excite_cli.robot.model import Array, Robot, build_robot
from tests.api.conftest import Loop
from tests.docs.test_predict import PLANTED

UR10 = RobotSpec(urdf=str(Path(__file__).parents[2] / "data" / "ur10_cb" / "ur10.urdf"))
WITHOUT_SLOPE = {"backlash", "contact"}
T = 0.02 * np.arange(40)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(UR10)


def model_of(robot: Robot, *kinds: str) -> Model:
    rows = [row for row in PLANTED if row[0] in kinds]
    effects = tuple(
        kind_named(name)(joints, dict(shape), (), "temp" if "covariate" in name else "")
        for name, joints, shape, _ in rows
    )
    values = np.concatenate([np.zeros(0), *(np.asarray(row[3], dtype=float) for row in rows)])
    made = IdentifiedModel(standard_parameters(robot), effects, values)
    return Model(StoredModel(Path("x"), "fit", SimpleNamespace(), Path("."), robot, made))  # type: ignore[arg-type]


def states(robot: Robot) -> Array:
    angle = np.outer(T, np.linspace(2.0, 7.0, robot.n)) + np.arange(robot.n)
    rates = np.linspace(2.0, 7.0, robot.n)
    return 0.4 * np.array([np.sin(angle), rates * np.cos(angle), -(rates**2) * np.sin(angle)])


@pytest.mark.parametrize("kind", sorted(set(catalogue()) - WITHOUT_SLOPE))
def test_slopes_of_every_effect_are_exact(kind: str, robot: Robot) -> None:
    model, x = model_of(robot, kind, "payload", "torque_gain"), states(robot)
    columns = {"temp": 30.0 + 5.0 * np.sin(T)}
    weights = np.random.default_rng(1).normal(size=x[0].shape)

    ways = np.random.default_rng(2).normal(size=(3, *x.shape))

    def along(steps: Array) -> float:
        state = x + np.tensordot(steps, ways, axes=1)
        return float((weights * model.torque(*state, T, columns, 50.0)).sum())

    with sign_of_width(0.2):  # differences need steps that are small beside it
        found = np.array(model.pull_back(weights, *x, T, columns, 50.0))
        reference = fourth_order_differences(along, np.zeros(3), 1e-5)
    found = np.tensordot(ways, found, axes=3)
    assert np.linalg.norm(found - reference) < 1e-5 * np.linalg.norm(reference)


def test_derivatives_are_those_of_single_states(robot: Robot) -> None:
    model, (q, v, a) = (
        model_of(robot, "viscous_friction", "spring", "coupled_friction"),
        states(robot),
    )
    by_q, by_v, by_a = model.derivatives(q, v, a)
    step = 1e-6 * np.eye(robot.n)[2]
    for found, ahead, behind in (
        (by_q, (q + step, v, a), (q - step, v, a)),
        (by_v, (q, v + step, a), (q, v - step, a)),
        (by_a, (q, v, a + step), (q, v, a - step)),
    ):
        slope = (model.torque(*ahead) - model.torque(*behind)) / 2e-6
        assert found[:, :, 2] == pytest.approx(slope, rel=1e-5, abs=1e-4)
    one = model.derivatives(q[3], v[3], a[3])
    assert one[0] == pytest.approx(by_q[3])


def test_a_state_alone_is_a_row_of_many(robot: Robot) -> None:
    model, (q, v, a) = model_of(robot, "viscous_friction", "ripple"), states(robot)
    assert model.torque(q[5], v[5], a[5]) == pytest.approx(model.torque(q, v, a)[5])


def test_friction_is_the_part_that_follows_the_speed(robot: Robot) -> None:
    kinds = ("viscous_friction", "coulomb_friction", "load_dependent_friction", "spring", "payload")
    model, (q, v, _) = model_of(robot, *kinds), states(robot)
    found = model.friction(q, v, load=np.full_like(q, -10.0))
    sign = np.tanh(v / 1e-3)
    assert found[:, 2] == pytest.approx(6.0 * v[:, 2] + 5.0 * sign[:, 2])
    assert found[:, 1] == pytest.approx(0.2 * 10.0 * sign[:, 1])
    assert not found[:, 0].any()
    own = model.torque(q, 0 * v, 0 * v)[:, 1]  # gravity, the payload's with it
    assert model.friction(q, v)[:, 1] == pytest.approx(0.2 * np.abs(own) * sign[:, 1])


def test_a_fit_predicts_as_its_table_says(loop: Loop) -> None:
    model = Model.load(loop.fit)
    stored = read_fit(loop.fit)
    (trace,) = [each for each in stored.traces if each.held_out]
    found = model.torque(trace.q, trace.v, trace.a)
    assert np.abs(found - trace.predicted).max() < 2e-2 * np.abs(trace.predicted).max()
    assert model.joint_names == stored.fit.joint_names
    assert repr(model).startswith("Model(")


def test_what_cannot_be_told_is_refused_in_one_sentence(robot: Robot, tmp_path: Path) -> None:
    q, v, a = states(robot)
    with pytest.raises(ConfigError, match=r"Give \(T, 6\) each, or \(6,\): shoulder_pan_joint"):
        model_of(robot).torque(q[:, :3], v, a)
    with pytest.raises(ConfigError, match=r"dahl_friction depends on other instants\. Give"):
        model_of(robot, "dahl_friction").torque(q, v, a)
    with pytest.raises(ConfigError, match="t is not equidistant"):
        model_of(robot).torque(q, v, a, T**2)
    with pytest.raises(ConfigError, match=r"t has shape \(3,\)"):
        model_of(robot).torque(q, v, a, T[:3])
    with pytest.raises(ConfigError, match="follows the column 'temp': give it in covariates"):
        model_of(robot, "covariate_offset").torque(q, v, a)
    with pytest.raises(ConfigError, match="no derivatives: contact has none"):
        model_of(robot, "contact").pull_back(q, q, v, a, T)
    with pytest.raises(FileError, match=r"There is no file none\.h5"):
        Model.load("none.h5")
    (tmp_path / "log.csv").write_text("t,q\n")
    with pytest.raises(FileError, match=r"log\.csv is no model: give a fit or a diagnosis"):
        Model.load(tmp_path / "log.csv")
