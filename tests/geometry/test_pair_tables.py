"""Tabled distances of meshes that capsules cannot tell apart, and the constraint on them."""

import os
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.constraints.self_collision import KEPT, MeshClearance
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.mesh_distances import MeshDistances
from excite_cli.geometry.mesh_pairs import PairTable
from excite_cli.geometry.pair_tables import FAR, mesh_tables, near_at_posture
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot, build_robot
from tests.constraints.test_gradients import check_gradients
from tests.urdf_elements import box, joint, link, robot_text


def _joint(name: str, ends: tuple[str, str], height: float, axis: str, limits: str) -> str:
    return joint(name, ends, f"0 0 {height}", axis, f'{limits} velocity="2" effort="5"')


# A bar on two crossed hinges above a plate: it strikes the plate when it tilts.
WRIST = robot_text(
    "wrist",
    link("plate", shapes=box("0.2 0.2 0.05")),
    _joint("roll", ("plate", "cross"), 0.06, "1 0 0", 'lower="-0.9" upper="0.8"'),
    link("cross", shapes=box("0.01 0.01 0.01")),
    _joint("pitch", ("cross", "bar"), 0.02, "0 1 0", 'lower="-0.9" upper="0.9"'),
    link("bar", shapes=box("0.16 0.06 0.02", "0.01 0 0")),
    _joint("twist", ("bar", "far"), 0.5, "0 0 1", 'lower="-1" upper="1"'),
    link("far", shapes='<collision><geometry><sphere radius="0.02"/></geometry></collision>'),
)
NONE = CollisionPairs((), ())


@pytest.fixture
def wrist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """With a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "wrist.urdf").write_text(WRIST, encoding="utf-8")
    return build_robot(RobotSpec(urdf="wrist.urdf"), relative_to=tmp_path)


def only(tables: tuple[PairTable, ...]) -> PairTable:
    assert [(table.first, table.second) for table in tables] == [("plate", "bar")]
    return tables[0]


def test_a_table_gives_the_distance_of_the_meshes(wrist: Robot) -> None:
    table = only(mesh_tables(wrist, (), NONE))
    assert table.joints == (0, 1)
    q = wrist.draw_states(400, 3)[0]
    brute = MeshDistances(wrist)
    true = np.minimum([brute.distance(["plate"], ["bar"], at) for at in q], FAR)
    found = table.distances(q)
    apart = true > 0.0
    assert 0.1 < np.mean(~apart) < 0.9
    assert table.touching == pytest.approx(np.mean(~apart), abs=0.1)
    assert table.error < 1e-3
    assert np.abs(found - true)[apart].max() < 1.5e-3
    # What is kept above the error of the table is clear, and nothing in contact passes.
    assert true[found > KEPT + table.error].min() > 0.5 * KEPT
    assert found[~apart].max() < KEPT


def test_slopes_lead_out_of_contact(wrist: Robot) -> None:
    table = only(mesh_tables(wrist, (), NONE))
    brute = MeshDistances(wrist)
    q = wrist.draw_states(200, 5)[0]
    q = q[table.distances(q) < 0]
    assert len(q) > 20
    for _ in range(400):
        slope = table.slopes(q)
        size = np.linalg.norm(slope, axis=1, keepdims=True)
        q[:, :2] += 0.01 * slope / np.maximum(size, 1e-9) * (table.distances(q) < 0.004)[:, None]
    assert np.mean([brute.distance(["plate"], ["bar"], at) > 0 for at in q]) > 0.95


def test_gradients_against_differences(wrist: Robot) -> None:
    constraint = MeshClearance(mesh_tables(wrist, (), NONE))
    check_gradients(wrist, constraint, 11, 1e-6)
    states = States(BatchKinematics(wrist), *wrist.draw_states(30, 11))
    found, _, _ = constraint.gradients(states, np.arange(30), np.zeros(30, dtype=np.intp))
    assert np.abs(found[:, 2]).max() == 0.0  # the third joint is not between them


def test_the_constraint_keeps_meshes_apart(wrist: Robot) -> None:
    constraint = MeshClearance(mesh_tables(wrist, (), NONE))
    q, v, a = wrist.draw_states(600, 21)
    margins = constraint.margins(States(BatchKinematics(wrist), q, v, a))[:, 0]
    brute = MeshDistances(wrist)
    true = np.array([brute.distance(["plate"], ["bar"], at) for at in q])
    assert 0.2 < np.mean(margins >= 0) < 0.95
    assert true[margins >= 0].min() > 0
    assert np.all(margins[true <= 0] < 0)


def test_pairs_that_need_no_table(wrist: Robot) -> None:
    def capsule(name: str, joint: int, by_hand: bool = False) -> Capsule:
        return Capsule(name, joint, np.zeros(3), np.ones(3), 0.1, (name,), by_hand)

    both = (capsule("plate", 0), capsule("bar", 2))
    assert not mesh_tables(wrist, both, CollisionPairs(((0, 1),), ()))
    assert mesh_tables(wrist, both, NONE)
    assert not mesh_tables(wrist, (both[0], capsule("bar", 2, by_hand=True)), NONE)
    assert not mesh_tables(wrist, (), NONE, ignore=(("bar", "plate"),))


def test_tables_come_back_from_disk(wrist: Robot) -> None:
    first = only(mesh_tables(wrist, (), NONE))
    with mock.patch("excite_cli.geometry.pair_tables.link_meshes", side_effect=AssertionError):
        again = only(mesh_tables(wrist, (), NONE))
    assert again.error == first.error
    assert again.touching == first.touching
    q = wrist.draw_states(50, 1)[0]
    assert np.array_equal(again.distances(q), first.distances(q))
    for path in Path(os.environ["XDG_CACHE_HOME"]).glob("excite/meshes-*"):
        path.write_bytes(b"damaged")
    assert np.array_equal(only(mesh_tables(wrist, (), NONE)).distances(q), first.distances(q))


def test_pairs_near_at_the_posture_are_named_and_get_no_table(wrist: Robot) -> None:
    """Tilted, the bar comes near the plate; tilted more, it strikes it."""
    meshes, near = MeshDistances(wrist), None
    for pitch in np.linspace(0.0, 0.9, 200):
        q = np.array([0.0, pitch, 0.0])
        if 0.003 < meshes.distance(["plate"], ["bar"], q) < 0.012:
            near = replace(wrist, posture=q)
    assert near is not None
    assert near_at_posture(near, (), NONE, kept=0.012) == (("plate", "bar"),)
    assert near_at_posture(near, (), NONE, kept=0.003) == ()
    assert near_at_posture(near, (), NONE, (("bar", "plate"),), kept=0.012) == ()
    assert mesh_tables(near, (), NONE, kept=0.012) == ()
    tilted = replace(wrist, posture=np.array([0.0, 0.9, 0.0]))
    assert near_at_posture(tilted, (), NONE, kept=0.012) == ()  # in contact: told, not judged
