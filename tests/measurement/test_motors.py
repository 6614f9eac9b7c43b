"""Motors that drive joints together: a log recorded at the motors is the same robot's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.load import parse_spec
from excite_cli.config.robot_spec import TransmissionSpec
from excite_cli.errors import ConfigError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Array, Dataset, Run
from excite_cli.measurement.motors import Motors, motors_of

JOINTS = ("shoulder", "pitch", "roll")
MATRIX = ((0.5, 0.5), (0.4, -0.6))
WRIST = TransmissionSpec(joints=("pitch", "roll"), motors=("m1", "m2"), matrix=MATRIX)
AT_MOTORS = {"position": "motor", "torque": "motor"}


def motors(spec: TransmissionSpec = WRIST) -> Motors:
    found = motors_of((spec,), JOINTS)
    assert found is not None
    return found


def joint_side(count: int = 400) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(1)
    t = 0.01 * np.arange(count)
    rates = rng.uniform(1.0, 4.0, 3)
    q, dq = np.sin(np.outer(t, rates)), rates * np.cos(np.outer(t, rates))
    return t, q, dq, rng.normal(size=(count, 3))


def at_motors(x: Array, torque: bool = False) -> Array:
    """By hand: θ = M⁻¹ q, and τ_motor = Mᵀ τ."""
    found, matrix = x.copy(), np.array(MATRIX)
    found[:, 1:] = x[:, 1:] @ (matrix if torque else np.linalg.inv(matrix).T)
    return found


def written(folder: Path, names: dict[str, tuple[str, ...]], **channels: Array) -> Path:
    """A CSV with columns named as said for each channel."""
    t = joint_side()[0]
    columns = {"t": t}
    for channel, values in channels.items():
        for name, column in zip(names.get(channel, JOINTS), values.T, strict=True):
            columns[f"{channel}_{name}"] = column
    path = folder / "log.csv"
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", fmt="%.17g",
               header=",".join(columns), comments="")  # fmt: skip
    return path


def read(path: Path, spec: TransmissionSpec = WRIST, **measurement: Any) -> Dataset:
    return read_dataset([path], MeasurementSpec(**measurement), JOINTS, motors=motors(spec))


MOTORS = ("shoulder", "m1", "m2")


def test_a_log_of_the_motors_becomes_that_of_the_joints(tmp_path: Path) -> None:
    _, q, dq, tau = joint_side()
    path = written(tmp_path, dict.fromkeys(("q", "dq", "tau"), MOTORS), q=at_motors(q),
                   dq=at_motors(dq), tau=at_motors(tau, torque=True))  # fmt: skip
    (run,) = read(path, **AT_MOTORS).runs
    np.testing.assert_allclose(run.q, q, atol=1e-12)
    np.testing.assert_allclose(run.dq, dq, atol=1e-12)
    np.testing.assert_allclose(run.tau, tau, atol=1e-12)


def test_power_is_the_same_on_both_sides(tmp_path: Path) -> None:
    _, q, dq, tau = joint_side()
    path = written(tmp_path, dict.fromkeys(("q", "dq", "tau"), MOTORS), q=q, dq=dq, tau=tau)
    (run,) = read(path, **AT_MOTORS).runs
    assert run.dq is not None
    np.testing.assert_allclose((run.tau * run.dq).sum(axis=1), (tau * dq).sum(axis=1), atol=1e-12)


def test_each_channel_is_taken_from_its_own_side(tmp_path: Path) -> None:
    """Positions of the joints beside torques of the motors, and names of the file's own."""
    _, q, _, tau = joint_side()
    path = written(tmp_path, {"tau": ("shoulder", "left", "right")}, q=q,
                   tau=at_motors(tau, torque=True))  # fmt: skip
    (run,) = read(path, torque="motor", names={"left": "m1", "right": "m2"}).runs
    np.testing.assert_allclose(run.q, q, atol=1e-12)
    np.testing.assert_allclose(run.tau, tau, atol=1e-12)


def test_gear_ratios_are_those_of_the_motors(tmp_path: Path) -> None:
    _, q, _, tau = joint_side()
    ratio = np.array([10.0, 50.0, -80.0])
    path = written(tmp_path, dict.fromkeys(("q", "tau"), MOTORS), q=at_motors(q) * ratio,
                   tau=at_motors(tau, torque=True) / ratio)  # fmt: skip
    gears = dict(zip(JOINTS, ratio.tolist(), strict=True))
    (run,) = read(path, **AT_MOTORS, gear_ratio=gears).runs
    np.testing.assert_allclose(run.q, q, atol=1e-12)
    np.testing.assert_allclose(run.tau, tau, atol=1e-12)


def test_a_joint_is_known_where_all_its_motors_are() -> None:
    t, q, _, tau = joint_side(6)
    valid = np.ones(tau.shape, bool)
    valid[2, 1], valid[3, 0] = False, False
    tau[2, 1] = np.nan
    run = Run("r", t, q, tau, valid=valid)
    spec = MeasurementSpec(torque="motor")
    found = motors().at_joints(run, spec)
    assert found.valid is not None
    expected = np.ones(tau.shape, bool)
    expected[2, 1:], expected[3, 0] = False, False
    np.testing.assert_array_equal(found.valid, expected)
    np.testing.assert_array_equal(np.isnan(found.tau), ~expected & (np.arange(6) == 2)[:, None])
    straight = WRIST.model_copy(update={"matrix": ((2.0, 0.0), (0.0, 3.0))})
    assert np.isnan(motors(straight).at_joints(run, spec).tau).sum() == 1


def test_robots_without_such_motors_have_none() -> None:
    assert motors_of((), JOINTS) is None
    assert motors_of((WRIST,), ("shoulder",)) is None


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"joints": ("pitch", "rol")}, ("transmissions[0].joints: 'rol' is not a moved joint",
                                        "Did you mean 'roll'", "or none")),
        ({"motors": ("m1", "shoulder")}, ("'shoulder' is another motor or joint already",)),
        ({"motors": ("m1", "m1")}, ("'m1' is another motor",)),
        ({"joints": ("pitch", "pitch")}, ("'pitch' is driven twice",)),
        ({"matrix": ((1.0, 1.0), (1.0, 1.0))}, ("matrix cannot be inverted", "m1, m2")),
    ],
)  # fmt: skip
def test_transmissions_that_do_not_fit(change: dict[str, Any], parts: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError) as caught:
        motors_of((WRIST.model_copy(update=change),), JOINTS)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("measurement", "part"),
    [
        ({"coupling": {"roll": {"pitch": 1.0}}}, "pitch, roll is driven by robot.transmissions"),
        ({"without_torque": ["roll"], "torque": "motor"}, "motor 'm2', that of pitch is not known"),
    ],
)
def test_measurements_that_contradict_the_motors(
    measurement: dict[str, Any], part: str, tmp_path: Path
) -> None:
    _, q, _, tau = joint_side()
    with pytest.raises(ConfigError, match=part):
        read(written(tmp_path, {}, q=q, tau=tau), **measurement)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("joints: [a, b], motors: [m], matrix: [[1]]", "2 joints and 1 motors"),
        ("joints: [a, b], motors: [m, n], matrix: [[1, 1]]", "2 rows of 2 numbers"),
        ("joints: [a], motors: [m], matrix: [[1]], limits: {x: {velocity: 1}}",
         "limits: 'x' is none of its motors"),
    ],
)  # fmt: skip
def test_sections_that_are_no_transmission(text: str, part: str) -> None:
    with pytest.raises(ConfigError, match=part):
        parse_spec(f"robot: {{urdf: arm.urdf, transmissions: [{{{text}}}]}}")
