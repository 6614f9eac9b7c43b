"""Torques of engines in this process: Pinocchio's and MuJoCo's are those of the model, to 1e-9."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from excite_cli import Model
from excite_cli.config.spec import Spec
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import MissingExtraError
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.stored_model import StoredModel
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note
from excite_cli.simulation.build import true_inertias
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop
from tests.robot.coupled_robots import HAND, coupled_robot
from tests.robot.random_robots import random_robot

HELD = ("viscous_friction", "coulomb_friction", "armature")
CARRIED = np.array([0.8, 0.02, 0.01, 0.03, 0.02, 0.0, 0.02, 0.0, 0.0, 0.02])


def model_of(robot: Robot, *kinds: str) -> Model:
    """Each kind on all joints, or of the whole robot; inertias are not the URDF's."""
    rng = np.random.default_rng(4)
    found = [
        kind_named(kind)(joints, {}, ())
        for kind in kinds
        for joints in (
            [tuple(range(robot.n))]
            if kind == "base_tilt"
            else [(robot.n - 1,)]
            if kind == "payload"
            else [(j,) for j in range(robot.n)]
        )
    ]
    sizes = {"base_tilt": np.array([0.03, -0.02]), "payload": CARRIED}
    values = [sizes.get(each.kind, rng.uniform(0.1, 2.0, len(each.parameters))) for each in found]
    made = IdentifiedModel(
        true_inertias(robot, 0.3, seed=2), tuple(found), np.concatenate([np.zeros(0), *values])
    )
    spec = Spec.model_validate({"robot": {"urdf": "x.urdf"}})
    return Model(StoredModel(Path("x"), "config", spec, Path(), robot, made))


def by_pinocchio(robot: Robot, model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    data = model.createData()
    states = zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)
    every = np.array([pin.rnea(model, data, *state) for state in states])
    return robot.gathered(every[:, robot.tree.moved])


def by_mujoco(robot: Robot, model: mujoco.MjModel, q: Array, v: Array, a: Array) -> Array:
    """Friction loss is a constraint to MuJoCo: its full force is added where joints move."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, found = mujoco.MjData(model), []
    q, v, a = robot.all_positions(q), robot.all_rates(v), robot.all_rates(a)
    for state in zip(q, v, a, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse + model.dof_frictionloss * np.sign(data.qvel))
    return robot.gathered(np.array(found))


@pytest.fixture(params=["tree", "floating", "followers"])
def robot(request: pytest.FixtureRequest) -> Robot:
    made: dict[str, Callable[[], Robot]] = {
        "tree": lambda: random_robot(3, joints=5),
        "floating": lambda: random_robot(3, joints=5, floating=True),
        "followers": lambda: coupled_robot(HAND),
    }
    return made[request.param]()


def states(robot: Robot) -> tuple[Array, Array, Array]:
    q, v, a = robot.draw_states(20, seed=1)
    return q, np.where(np.abs(v) < 0.1, 0.1, v), a  # the sign of the speed is a steep function


@pytest.mark.parametrize("kinds", [("armature", "payload"), ("armature", "base_tilt")])
def test_pinocchio_holds_bodies_rotors_and_gravity(robot: Robot, kinds: tuple[str, ...]) -> None:
    model, x, heard = model_of(robot, *kinds), states(robot), list[Note]()
    found = by_pinocchio(robot, model.pinocchio(heard.append), *x)
    assert np.abs(found - model.torque(*x)).max() < 1e-9
    assert heard == []


def test_pinocchio_says_what_its_inverse_dynamics_lacks(robot: Robot) -> None:
    model, x, heard = model_of(robot, *HELD, "spring"), states(robot), list[Note]()
    engine = model.pinocchio(heard.append)
    own = model.made.model
    within = own.without(tuple(each for each in own.effects if each.kind != "armature"))
    expected = Model(replace(model.made, model=within)).torque(*x)
    assert np.abs(by_pinocchio(robot, engine, *x) - expected).max() < 1e-9
    (note,) = heard
    assert note.level is Level.WARNING
    assert all(f"{kind} at " in note.text for kind in (*HELD[:2], "spring"))
    assert "armature" not in note.text


def test_mujoco_holds_rotors_and_straight_friction(robot: Robot) -> None:
    model, heard = model_of(robot, *HELD, "payload"), list[Note]()
    x = states(robot)
    found = by_mujoco(robot, model.to_mjmodel(heard.append), *x)
    assert np.abs(found - model.torque(*x)).max() < 1e-9
    assert {note.level for note in heard} == {Level.NOTE}


def test_mujoco_says_what_it_lacks() -> None:
    heard: list[Note] = []
    model_of(random_robot(3, joints=3), "torque_gain").to_mjmodel(heard.append)
    assert any("torque_gain" in n.text and n.level is Level.WARNING for n in heard)


def test_engines_have_the_consistent_bodies_of_a_fit(loop: Loop) -> None:
    model = Model.load(loop.fit).consistent
    robot, x = model.made.robot, states(model.made.robot)
    for found in (by_pinocchio(robot, model.pinocchio(), *x),
                  by_mujoco(robot, model.to_mjmodel(), *x)):  # fmt: skip
        assert np.abs(found - model.torque(*x)).max() < 1e-9


def test_without_mujoco_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"excite-cli\[sim\]"):
        model_of(random_robot(3, joints=3)).to_mjmodel()
