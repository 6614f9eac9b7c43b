"""Orders and signs judged with the URDF: caught where they can be, never a false alarm."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest

from excite_cli.checks.all_checks import check_dataset, standing_legs
from excite_cli.checks.setup import Samples
from excite_cli.config.load_spec import load_spec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import robot_with
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.ground_truth import PlantedEffect, plant
from tests import urdf_elements
from tests.simulation.arms import arm, played

pytestmark = pytest.mark.long

LOGS = Path(__file__).resolve().parents[2] / "data"
URDFS = {"kr300": "kr300.urdf", "tx40": "tx40_mdh_modified.urdf", "ur10_cb": "ur10.urdf"}
SPEC: Spec = load_spec(Path(__file__).resolve().parents[2] / "configs" / "ur10.yaml")
SIZES = [10.0, 15.0, 8.0, 3.0, 2.0, 1.0]  # N·m of dry friction
ROBOT = arm()


def friction(j: int, size: float) -> PlantedEffect:
    return plant(kind_named("coulomb_friction"), (j,), size)


@pytest.fixture(scope="module")
def rubbing() -> Dataset:
    effects = [friction(j, size) for j, size in enumerate(SIZES)]
    return played(ROBOT, *effects, torque_noise=0.01, inertia_error=0.3).dataset


@pytest.fixture(scope="module")
def frictionless() -> Dataset:
    return played(ROBOT, torque_noise=0.01, inertia_error=0.1).dataset


def told(robot: Robot, data: Dataset, spec: Spec = SPEC) -> str:
    """What is said, be it certain or not."""
    try:
        return "".join(found.text for found in check_dataset(robot, data, spec))
    except FileError as error:
        return str(error)


def changed(data: Dataset, order: Array | None = None, tau: Array | None = None,
            q: Array | None = None, motion_order: Array | None = None) -> Dataset:  # fmt: skip
    """Columns of torque (and motion) in another order, then with other signs."""
    here = np.arange(len(data.joint_names))
    order = here if order is None else order
    motion = here if motion_order is None else motion_order
    ones = np.ones(len(here))
    tau, q = (ones if each is None else each for each in (tau, q))
    runs = tuple(
        replace(r, q=r.q[:, motion] * q, dq=None, tau=r.tau[:, order] * tau) for r in data.runs
    )
    return replace(data, runs=runs)


def negative(j: int, n: int = 6) -> Array:
    return np.where(np.arange(n) == j, -1.0, 1.0)


def test_clean_data_raise_no_alarm(rubbing: Dataset, frictionless: Dataset) -> None:
    assert told(ROBOT, rubbing) == ""
    assert told(ROBOT, frictionless) == ""
    # Torques of joints that stand are not judged. What they carry is up to their friction:
    # anything.
    rng = np.random.default_rng(0)

    def with_rest(run: Run) -> Run:
        q, tau = run.q.copy(), run.tau.copy()
        q[:, 2:] = q[0, 2:]
        tau[:, 2:] = 50 * rng.normal(size=(len(tau), 4))
        return replace(run, q=q, tau=tau, dq=None)

    assert told(ROBOT, replace(rubbing, runs=tuple(map(with_rest, rubbing.runs)))) == ""
    # A wrist without friction cannot be judged and nothing wrong is said. The last link's torque
    # comes from a centre of mass that the URDF puts on its axis: which side it is on, the sign of
    # the torque, nobody can know. No other joint may be accused.
    message = told(ROBOT, changed(frictionless, tau=negative(5)))
    assert message == "" or "torque of wrist_3_joint has the opposite sign" in message


@pytest.mark.parametrize("j", range(6))
def test_a_torque_or_a_position_of_other_sign(rubbing: Dataset, j: int) -> None:
    name = ROBOT.joint_names[j]
    message = told(ROBOT, changed(rubbing, tau=negative(j)))
    assert f"torque of {name} has the opposite sign" in message
    message = told(ROBOT, changed(rubbing, q=negative(j)))
    # Of light wrists, torque and position cannot be told apart, and both are named.
    assert f"measurement.position_sign: {{{name}: -1}}" in message
    assert j > 2 or "set measurement.sign" not in message


def test_what_is_declared_is_not_judged(rubbing: Dataset) -> None:
    """A sign given for a joint settles that joint alone, `trust` everything."""
    name, other = ROBOT.joint_names[1], ROBOT.joint_names[2]

    def with_(**declared: object) -> Spec:
        measured = SPEC.measurement.model_copy(update=declared)
        return SPEC.model_copy(update={"measurement": measured})

    wrong = changed(rubbing, tau=negative(1))
    message = told(ROBOT, wrong)
    assert f"measurement.sign: {{{name}: -1}}" in message
    assert f"If the config is right, set measurement.sign: {{{name}: 1}}." in message
    assert "measurement.sign" not in told(ROBOT, wrong, with_(sign={name: 1}))
    assert name in told(ROBOT, wrong, with_(sign={other: 1}))
    reversed_ = changed(rubbing, order=np.arange(6)[::-1])
    assert "measurement.trust: [order of columns]" in told(ROBOT, reversed_)
    assert told(ROBOT, reversed_, with_(trust=True)) == ""


def test_inertias_of_a_wrist_may_be_anything() -> None:
    """Centres of mass 3 cm off turn a light wrist's torque round; nobody is refused for it."""
    phi = standard_parameters(ROBOT).reshape(-1, 10).copy()
    for body in phi:
        body[1:4] -= 0.03 * body[0] * np.sign(body[1:4] + 1e-12)
    true = replace(ROBOT, model=robot_with(ROBOT, phi.ravel()))
    data = played(true, torque_noise=0.01, inertia_error=0.1).dataset
    assert check_dataset(ROBOT, data, SPEC) == ()


def test_all_torques_of_other_sign(rubbing: Dataset) -> None:
    message = told(ROBOT, changed(rubbing, tau=-np.ones(6)))
    assert "torque of every joint has the opposite sign" in message
    assert "position" not in message.split("As configured")[0].replace("position_sign", "")


ORDERS = {
    "swap": [0, 2, 1, 3, 4, 5],
    "wrist": [0, 1, 2, 5, 4, 3],
    "shift": [1, 2, 3, 4, 5, 0],
    "reversal": [5, 4, 3, 2, 1, 0],
}


@pytest.mark.parametrize("name", ORDERS)
def test_torques_in_another_order(rubbing: Dataset, name: str) -> None:
    order = np.array(ORDERS[name])
    message = told(ROBOT, changed(rubbing, order=order))
    moved = [ROBOT.joint_names[j] for j in range(6) if order[j] != j]
    assert "torques" in message.split("As configured")[0]
    assert all(joint in message for joint in moved)
    assert "has the opposite sign" not in message.split("As configured")[0]


def test_torques_in_another_order_beside_joints_without_any(rubbing: Dataset) -> None:
    """What is not known is neither exchanged nor blamed."""

    def without_wrist(data: Dataset) -> Dataset:
        known = np.array([True] * 4 + [False] * 2)
        runs = [replace(r, tau=r.tau * known, valid=r.usable() & known) for r in data.runs]
        return replace(data, runs=tuple(runs))

    assert told(ROBOT, without_wrist(rubbing)) == ""
    message = told(ROBOT, without_wrist(changed(rubbing, order=np.array(ORDERS["swap"]))))
    said = message.split("As configured")[0]
    names = ROBOT.joint_names
    assert "torques" in said
    assert [name in said for name in names] == [False, True, True, False, False, False]


@pytest.mark.parametrize("name", ["swap", "shift", "reversal"])
def test_whole_joints_in_another_order(rubbing: Dataset, name: str) -> None:
    order = np.array(ORDERS[name])
    message = told(ROBOT, changed(rubbing, order=order, motion_order=order))
    assert "the columns" in message
    assert "measurement.names" in message
    j = int(np.flatnonzero(order != np.arange(6))[0])
    # File column j carries the name of j, but holds joint order[j].
    assert f"{ROBOT.joint_names[j]}: {ROBOT.joint_names[order[j]]}" in message


@pytest.mark.parametrize("name", URDFS)
def test_real_logs(name: str) -> None:
    robot = build_robot(RobotSpec(urdf=str(LOGS / name / URDFS[name])))
    data = read_dataset([LOGS / name / f"{name}.h5"], SPEC.measurement, robot.joint_names)
    for run in data.runs:
        assert told(robot, replace(data, runs=(run,))) == ""
    message = told(robot, changed(data, tau=negative(2)))
    assert f"torque of {robot.joint_names[2]} has the opposite sign" in message


_BONE = 0.35
SIDES, PARTS = ("left", "right"), ("hip", "knee", "ankle")
JOINTS = tuple(f"{side}_{part}" for side in SIDES for part in PARTS)
_SOLE = urdf_elements.box("0.24 0.12 0.02", "0.02 0 -0.03")
_LIMITS = 'lower="-2.5" upper="2.5" velocity="5" effort="900"'


def _link(name: str, mass: float, center: str, shapes: str = "") -> str:
    return urdf_elements.link(name, mass, "0.05 0.04 0.03", center, shapes)


def _leg(side: str, y: float) -> str:
    bones = [
        _link(f"{side}_thigh", 5.0, "0 0 -0.15"),
        _link(f"{side}_shank", 3.0, "0 0 -0.15"),
        _link(f"{side}_foot", 1.0, "0.02 0 -0.02", _SOLE),
    ]
    names = ["pelvis", *(f"{side}_{bone}" for bone in ("thigh", "shank", "foot"))]
    places = (f"0 {y} 0", f"0 0 {-_BONE}", f"0 0 {-_BONE}")
    for part, ends, place in zip(PARTS, pairwise(names), places, strict=True):
        bones.append(urdf_elements.joint(f"{side}_{part}", ends, place, "0 1 0", _LIMITS))
    return "".join(bones)


PELVIS = _link("pelvis", 30.0, "0.02 0 0.2")
URDF = urdf_elements.robot_text("biped", PELVIS, _leg("left", 0.12), _leg("right", -0.12))


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("biped") / "biped.urdf"
    path.write_text(URDF, encoding="utf-8")
    return build_robot(RobotSpec(urdf=str(path)))


def squatting(standing: bool) -> Samples:
    """On the floor, or with the pelvis held in the air: positions and torques of the motors."""
    extra = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco></robot>'
    spec = mujoco.MjSpec.from_string(URDF.replace("</robot>", extra))
    pelvis = spec.body("pelvis")
    height = 2 * _BONE + 0.04
    pelvis.pos = [0, 0, height]
    if standing:
        pelvis.add_freejoint()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    for name in JOINTS:
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm[0], motor.biasprm[1], motor.biasprm[2] = 3000.0, -3000.0, -100.0
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    model = spec.compile()
    model.opt.timestep = 1e-3
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(model)
    dofs = [model.joint(name).dofadr[0] for name in JOINTS]
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    rows: list[tuple[Array, ...]] = []
    for k in range(6000):
        bend = 0.4 - 0.35 * np.cos(0.8 * data.time)
        data.ctrl[:] = np.tile([-bend, 2.0 * bend, -bend], 2) * min(1.0, data.time)
        mujoco.mj_step(model, data)
        if k > 2500 and k % 20 == 0:
            seen = data.qpos[places], data.qvel[dofs], data.qacc[dofs], data.actuator_force
            rows.append(tuple(each.copy() for each in seen))
    if standing:
        assert data.qpos[2] > 0.6 * height  # it has not fallen
        assert data.ncon >= 4
    q, v, a, tau = (np.array(x) for x in zip(*rows, strict=True))
    yes = np.ones(q.shape, bool)
    return Samples(q, v, a, tau, np.sign(v)[:, :, None], tau[None], yes, yes)


def test_legs_that_carry_are_told_from_legs_that_hang(robot: Robot) -> None:
    words = (
        r"stands on left_foot and right_foot, not of one that hangs .* \(1\d\d N at left_foot, "
        r"1\d\d N at right_foot; it weighs 471 N\) explain 8\d% of what the URDF leaves. Declare "
        r"robot.base: floating"
    )
    (found,) = standing_legs(robot, squatting(standing=True))
    assert found.status == "fault"
    assert re.search(words, found.evidence)
    assert not standing_legs(robot, squatting(standing=False))
    # Wrong masses and loads do not stand. What hangs and is not as the URDF says is pulled down by
    # it, or little.
    hanging = squatting(standing=False)
    heavier = Samples(**{**vars(hanging), "tau": 1.6 * hanging.tau})
    lighter = Samples(**{**vars(hanging), "tau": 0.5 * hanging.tau})
    opposite = Samples(**{**vars(hanging), "tau": -hanging.tau})
    for each in (heavier, lighter, opposite):
        assert not standing_legs(robot, each)
