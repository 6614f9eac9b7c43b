"""Motors that drive joints together: a log recorded at the motors is the same robot's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.robot_spec import TransmissionSpec
from excite_cli.errors import ConfigError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Array, Dataset, Run
from excite_cli.measurement.motors import Motors, motors_of
from tests.measurement.recordings import named, write_table

JOINTS = ("shoulder", "pitch", "roll")
MOTORS = ("shoulder", "m1", "m2")
MATRIX = ((0.5, 0.5), (0.4, -0.6))
WRIST = TransmissionSpec(joints=("pitch", "roll"), motors=("m1", "m2"), matrix=MATRIX)
AT_MOTORS = {"position": "motor", "torque": "motor"}
T = 0.01 * np.arange(400)
RATES = np.array([1.5, 2.9, 3.8])
Q, DQ = np.sin(np.outer(T, RATES)), RATES * np.cos(np.outer(T, RATES))
TAU = np.random.default_rng(1).normal(size=Q.shape)


def motors(spec: TransmissionSpec = WRIST) -> Motors:
    found = motors_of((spec,), JOINTS)
    assert found is not None
    return found


def at_motors(x: Array, torque: bool = False) -> Array:
    """By hand: θ = M⁻¹ q, and τ_motor = Mᵀ τ."""
    found, matrix = x.copy(), np.array(MATRIX)
    found[:, 1:] = x[:, 1:] @ (matrix if torque else np.linalg.inv(matrix).T)
    return found


def read(folder: Path, *columns: dict[str, Array], **measurement: Any) -> Dataset:
    """A CSV of these columns, as it is read."""
    table = {"t": T}
    for each in columns:
        table |= each
    path = write_table(folder / "log.csv", table)
    return read_dataset([path], MeasurementSpec(**measurement), JOINTS, motors=motors())


@pytest.mark.parametrize("ratio", [np.ones(3), np.array([10.0, 50.0, -80.0])])
def test_a_log_of_the_motors_becomes_that_of_the_joints(tmp_path: Path, ratio: Array) -> None:
    """Gear ratios are those of the motors."""
    (run,) = read(
        tmp_path,
        named("q", at_motors(Q) * ratio, MOTORS),
        named("dq", at_motors(DQ) * ratio, MOTORS),
        named("tau", at_motors(TAU, torque=True) / ratio, MOTORS),
        gear_ratio=dict(zip(JOINTS, ratio.tolist(), strict=True)),
        **AT_MOTORS,
    ).runs
    for found, known in ((run.q, Q), (run.dq, DQ), (run.tau, TAU)):
        np.testing.assert_allclose(found, known, atol=1e-12)


def test_each_channel_is_taken_from_its_own_side(tmp_path: Path) -> None:
    """Positions of the joints beside torques of the motors, and names of the file's own."""
    torques = named("tau", at_motors(TAU, torque=True), ("shoulder", "left", "right"))
    names = {"left": "m1", "right": "m2"}
    (run,) = read(tmp_path, named("q", Q, JOINTS), torques, torque="motor", names=names).runs
    np.testing.assert_allclose(run.q, Q, atol=1e-12)
    np.testing.assert_allclose(run.tau, TAU, atol=1e-12)


def test_a_joint_is_known_where_all_its_motors_are() -> None:
    valid, tau = np.ones((6, 3), bool), TAU[:6].copy()
    valid[2, 1], valid[3, 0] = False, False
    tau[2, 1] = np.nan
    run = Run("r", T[:6], Q[:6], tau, valid=valid)
    spec = MeasurementSpec(torque="motor")
    found = motors().at_joints(run, spec)
    assert found.valid is not None
    assert np.argwhere(~found.valid).tolist() == [[2, 1], [2, 2], [3, 0]]
    assert np.argwhere(np.isnan(found.tau)).tolist() == [[2, 1], [2, 2]]
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
        motors(WRIST.model_copy(update=change))
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
    with pytest.raises(ConfigError, match=part):
        read(tmp_path, named("q", Q, JOINTS), named("tau", TAU, JOINTS), **measurement)


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
