"""Capsules and obstacles: distances against coal, and which pairs are checked.

Gradients against differences; of pairs also how far apart they are kept, and what is reported.
"""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.constraints_spec import (
    BoxSpec,
    SelfCollisionSpec,
    SurroundingsSpec,
    WallSpec,
)
from excite_cli.config.robot_spec import PayloadSpec, RobotSpec
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.errors import ConfigError
from excite_cli.excitation.gradient_check import central_differences
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.obstacle_pairs import (
    ObstacleDistances,
    ObstaclePairs,
    choose_obstacle_pairs,
)
from excite_cli.geometry.obstacles import (
    Box,
    build_obstacles,
    point_distances,
    segment_contacts,
    segment_distances,
)
from excite_cli.geometry.reasons import Why, reason_in_words
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import carried_bodies
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot
from tests.robot.smoke_arm import ARM as SMOKE

from .obstacle_worlds import coal_distance, coal_distances, random_capsules, random_obstacles

KINDS = ("free", "short", "level", "edge", "point", "inside", "pierces")


def _segment(rng: np.random.Generator, kind: str, half: np.ndarray) -> tuple[np.ndarray, ...]:
    start, along = rng.normal(size=3) * 0.6, rng.normal(size=3) * 0.6
    if kind == "short":
        along *= 0.05
    elif kind == "level":  # parallel to a face
        along[rng.integers(3)] = 0.0
    elif kind == "edge":  # parallel to an edge
        along *= np.eye(3)[rng.integers(3)]
    elif kind == "point":
        along[:] = 0.0
    elif kind == "inside":
        start, along = 0.8 * half * rng.uniform(-1, 1, 3), 0.1 * half * rng.normal(size=3)
    elif kind == "pierces":
        start = rng.normal(size=3) * 0.6
        along = 2 * (half * rng.uniform(-0.9, 0.9, 3) - start)
    return start, along


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS))
def test_segment_and_box_against_coal(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.02, 0.6, 3)
    start, along = _segment(rng, kind, half)
    distance = float(segment_distances(start[:, None], along[:, None], half)[0])
    box = Box("box", np.eye(3), np.zeros(3), half)
    capsule = Capsule("capsule", 0, start, start + along, 0.05, ("capsule",))
    expected = coal_distance(capsule, pin.SE3.Identity(), box)
    assert distance - 0.05 == pytest.approx(expected, abs=1e-6)
    contact = segment_contacts(start[:, None], along[:, None], half)
    assert contact.distance[0] == distance
    assert 0 <= contact.share[0] <= 1
    assert np.linalg.norm(contact.normal[:, 0]) == pytest.approx(1.0)
    # Moved back along the normal by the distance, the witness touches the box (or leaves it).
    moved = start[:, None] - (distance - 1e-9) * contact.normal
    assert float(segment_distances(moved, along[:, None], half)[0]) == pytest.approx(0, abs=1e-7)


def test_continuous_through_contact_and_falling_beyond() -> None:
    """A level rod sinks into a table: as deep as it has sunk, until the underside is nearer."""
    half = np.array([0.5, 0.5, 0.1])
    heights = np.linspace(0.3, 0.02, 29)
    start = np.array([np.full(29, -0.2), np.zeros(29), heights])
    along = np.repeat([[0.4], [0.0], [0.0]], 29, axis=1)
    np.testing.assert_allclose(segment_distances(start, along, half), heights - 0.1, atol=1e-12)
    contacts = segment_contacts(start, along, half)
    np.testing.assert_allclose(contacts.normal, np.repeat([[0.0], [0.0], [1.0]], 29, axis=1))
    start, along = np.array([[-0.9], [0.0], [0.3]]), np.array([[0.8], [0.0], [0.0]])
    # Level with the top from x = -0.5, half way along, to its end: witnesses lie in the middle.
    assert segment_contacts(start, along, half).share[0] == pytest.approx(0.75)
    points = np.random.default_rng(0).normal(size=(3, 500)) * 0.5
    np.testing.assert_allclose(
        point_distances(points, half), segment_distances(points, 0 * points, half), atol=1e-9
    )


@pytest.mark.parametrize("seed", range(6))
def test_distances_on_random_robots_equal_coal(seed: int) -> None:
    robot = random_robot(seed, joints=5, floating=seed % 2 == 1)
    rng = np.random.default_rng(seed)
    capsules, obstacles = random_capsules(rng, robot), random_obstacles(rng)
    pairs = [(i, j) for i in range(len(capsules)) for j in range(len(obstacles))]
    rng.shuffle(pairs)
    pairs = [tuple(pair) for pair in pairs]
    measure = ObstacleDistances(robot, capsules, obstacles, pairs)
    q = robot.draw_states(30, seed)[0]
    found = measure.distances(q)
    assert found.shape == (30, measure.n_pairs)
    assert (found < 0).any()
    np.testing.assert_allclose(found, coal_distances(robot, capsules, obstacles, pairs, q),
                               atol=1e-6)  # fmt: skip
    for reach in (0.0, 0.1, 0.4):
        quick = measure.distances(q, exact_below=reach)
        near = found < reach
        np.testing.assert_allclose(quick[near], found[near], atol=1e-12)
        assert np.all(quick[~near] >= reach - 1e-12)
        assert np.all(quick <= found + 1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_gradients_on_random_robots_equal_differences(seed: int) -> None:
    robot = random_robot(seed, joints=5, floating=seed % 2 == 1)
    rng = np.random.default_rng(seed)
    capsules, obstacles = random_capsules(rng, robot), random_obstacles(rng)
    pairs = [(i, j) for i in range(len(capsules)) for j in range(len(obstacles))]
    measure = ObstacleDistances(robot, capsules, obstacles, pairs)
    q, v, a = robot.draw_states(8, seed)
    states = States(BatchKinematics(robot), q, v, a)
    inside = np.argwhere(measure.distances(q) < -0.02)
    both = [rng.integers(0, (8, len(pairs)), (16, 2)), rng.permutation(inside)[:8]]
    rows, cols = np.vstack(both).T
    gradients = measure.gradients(states, rows, cols)
    np.testing.assert_array_equal(gradients, measure.gradients(q, rows, cols))
    wrong = 0
    for k, (t, column) in enumerate(zip(rows, cols, strict=True)):

        def distance(x: np.ndarray, c: int = column) -> float:
            return float(measure.distances(x[None])[0, c])

        steps = [central_differences(distance, q[t], step) for step in (1e-6, 1e-7)]
        if np.abs(steps[0] - steps[1]).max() > 1e-4:  # a bend of the distance lies between
            wrong += 1
            continue
        np.testing.assert_allclose(gradients[k], steps[0], atol=2e-6)
    assert wrong <= 2


def test_no_pairs() -> None:
    robot = random_robot(1, joints=3)
    rng = np.random.default_rng(0)
    empty = ObstacleDistances(robot, random_capsules(rng, robot), random_obstacles(rng), [])
    assert empty.distances(np.zeros((4, 3))).shape == (4, 0)
    none = np.zeros(0, dtype=np.intp)
    assert empty.gradients(np.zeros((4, 3)), none, none).shape == (0, 3)


def _smoke(payload: PayloadSpec | None = None) -> tuple[Robot, tuple[Capsule, ...]]:
    robot = build_robot(RobotSpec(urdf=str(SMOKE), payload=payload))
    return robot, fit_capsules(robot, SelfCollisionSpec())


def _names(
    spec: SurroundingsSpec, payload: PayloadSpec | None = None
) -> tuple[dict[str, float], dict[str, str], ObstaclePairs]:
    """Distance kept by every checked pair, and the reason of every other."""
    robot, capsules = _smoke(payload)
    things = build_obstacles(spec)
    pairs = choose_obstacle_pairs(robot, capsules, things, spec)
    names = [f"{capsules[i].name} {things[j].name}" for i, j in pairs.checked]
    checked = dict(zip(names, map(float, pairs.kept), strict=True))
    dropped = {f"{d.first} {d.second}": reason_in_words(d.reason) for d in pairs.dropped}
    return checked, dropped, pairs


@pytest.mark.parametrize("seed", range(8))
def test_what_is_out_of_reach_stays_so(seed: int) -> None:
    robot = random_robot(seed, joints=5, floating=seed % 2 == 1)
    rng = np.random.default_rng(seed)
    capsules, things = random_capsules(rng, robot), random_obstacles(rng)
    spec = SurroundingsSpec(floor=-0.3, margin=0.05)
    pairs = choose_obstacle_pairs(robot, capsules, things, spec)
    number = {c.name: i for i, c in enumerate(capsules)}
    thing = {t.name: j for j, t in enumerate(things)}
    far = [
        (number[d.first], thing[d.second])
        for d in pairs.dropped
        if d.reason.why is Why.OUT_OF_REACH
    ]
    moving = [i for i, c in enumerate(capsules) if carried_bodies(robot)[c.joint].any()]
    assert len(pairs.checked) + len(pairs.dropped) == len(moving) * len(things)
    if far:
        q = robot.draw_states(2000, 99)[0]
        assert ObstacleDistances(robot, capsules, things, far).distances(q).min() > spec.margin


def test_far_things_are_out_of_reach_and_near_ones_are_not() -> None:
    checked, dropped, _ = _names(
        SurroundingsSpec(
            floor=-3.0, walls={"wall": WallSpec(point=(0.6, 0.0, 0.0), normal=(-2.0, 0.0, 0.0))}
        )
    )
    assert {"forearm wall", "wrist wall", "tool wall"} <= set(checked)
    assert all(reason == "out of reach" for reason in dropped.values())
    assert {name for name in dropped if name.endswith("floor")} >= {"tool floor", "column floor"}


def test_a_table_that_the_first_link_stands_on() -> None:
    """The column turns about the vertical: its distance from the table's top never changes."""
    top = 0.21
    table = BoxSpec(size=(2.0, 2.0, 0.2), position=(0.0, 0.0, top - 0.1))
    checked, dropped, _ = _names(SurroundingsSpec(boxes={"table": table}, margin=0.02))
    assert dropped["column table"].startswith("always in contact")
    assert "forearm table" in checked
    assert checked["tool table"] == 0.02


def test_a_link_that_never_gets_far_keeps_half_of_the_farthest() -> None:
    table = BoxSpec(size=(2.0, 2.0, 0.2), position=(0.0, 0.0, 0.22))  # just below the shoulder
    checked, dropped, pairs = _names(SurroundingsSpec(boxes={"table": table}, margin=0.05))
    robot, capsules = _smoke()
    things = build_obstacles(SurroundingsSpec(boxes={"table": table}))
    distances = ObstacleDistances(robot, capsules, things, pairs.checked).distances(
        robot.draw_states(3000, 5)[0]
    )
    farthest = dict(zip(checked, distances.max(axis=0), strict=True))
    assert 0 < checked["upper_arm table"] < 0.05
    assert checked["upper_arm table"] == pytest.approx(farthest["upper_arm table"] / 2, abs=0.005)
    assert checked["tool table"] == 0.05
    assert "upper_arm table" not in dropped


def test_a_thing_that_swallows_the_robot_is_no_contact() -> None:
    box = BoxSpec(size=(6.0, 6.0, 6.0), position=(0.0, 0.0, 0.0))
    checked, dropped, _ = _names(SurroundingsSpec(boxes={"block": box}))
    assert set(checked) == {"upper_arm block", "forearm block", "wrist block", "tool block"}
    assert dropped["column block"].startswith("always in contact (up to ")


def test_a_payload_is_never_taken_for_a_contact() -> None:
    payload = PayloadSpec(link="column", start=(0, 0, 0), end=(0, 0, -0.1), radius=0.15)
    checked, dropped, _ = _names(SurroundingsSpec(floor=0.0), payload)
    assert checked["payload floor"] == 0.0
    assert "payload floor" not in dropped


def test_ignored_pairs_in_either_order() -> None:
    spec = SurroundingsSpec(floor=0.0, ignore=(("tool", "floor"), ("floor", "wrist")))
    checked, dropped, _ = _names(spec)
    assert dropped["tool floor"] == dropped["wrist floor"] == "ignored in the config"
    assert "forearm floor" in checked
    still = [name for name in (*checked, *dropped) if name.startswith("base ")]
    assert not still, "what stands still is not spoken of"


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (("toll", "floor"), "no link 'toll'. Did you mean 'tool'"),
        (("floor", "toll"), "no link 'toll'. Did you mean 'tool'"),
        (("tool", "flor"), "no obstacle 'flor'. Did you mean 'floor'.*Obstacles: floor, table"),
        (("payload", "floor"), "no link 'payload'"),
    ],
)
def test_unknown_names_are_refused_with_the_nearest(pair: tuple[str, str], message: str) -> None:
    table = BoxSpec(size=(1.0, 1.0, 0.1), position=(0.5, 0.0, 0.1))
    with pytest.raises(ConfigError, match=message):
        _names(SurroundingsSpec(floor=0.0, boxes={"table": table}, ignore=(pair,)))


def test_nothing_left_but_contacts_is_refused() -> None:
    column = RobotSpec(urdf=str(SMOKE), joints=("shoulder_yaw",))
    robot = build_robot(column)
    capsules = (Capsule("column", 1, np.zeros(3), np.array([0, 0, 0.1]), 0.06, ("column",)),)
    spec = SurroundingsSpec(floor=0.19)
    with pytest.raises(ConfigError, match=r"nothing is left to check: column and floor are always"):
        choose_obstacle_pairs(robot, capsules, build_obstacles(spec), spec)
