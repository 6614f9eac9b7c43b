"""Which pairs of a capsule and an obstacle are checked, how far apart, and what is reported."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.constraints_spec import (
    BoxSpec,
    SelfCollisionSpec,
    SurroundingsSpec,
    WallSpec,
)
from excite_cli.config.robot_spec import PayloadSpec, RobotSpec
from excite_cli.errors import ConfigError
from excite_cli.geometry.capsules import Capsule, fit_capsules
from excite_cli.geometry.obstacle_distances import ObstacleDistances
from excite_cli.geometry.obstacle_pairs import ObstaclePairs, choose_obstacle_pairs
from excite_cli.geometry.obstacles import build_obstacles
from excite_cli.geometry.reasons import Why, reason_in_words
from excite_cli.robot.carried_bodies import carried_bodies
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot

from .obstacle_worlds import random_capsules, random_obstacles

SMOKE = Path(__file__).parents[2] / "data" / "smoke_arm.urdf"


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
    checked = {
        f"{capsules[i].name} {things[j].name}": float(kept)
        for (i, j), kept in zip(pairs.checked, pairs.kept, strict=True)
    }
    return (
        checked,
        {f"{d.first} {d.second}": reason_in_words(d.reason) for d in pairs.dropped},
        pairs,
    )


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


def test_what_stands_still_is_not_spoken_of() -> None:
    checked, dropped, _ = _names(SurroundingsSpec(floor=0.0))
    assert not any(name.startswith("base ") for name in (*checked, *dropped))


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
