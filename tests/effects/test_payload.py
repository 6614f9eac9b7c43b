"""A payload on any leaf or link: its columns, the numbers told of it, and what is no body."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.dynamics.pseudo_inertia import moved
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import declared_effects
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.placing import places_named, told_on
from excite_cli.errors import ConfigError
from excite_cli.robot.link_frame import LinkFrame, leaves, link_frame
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.ground_truth import parse_planted
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

_, SPHERE = Payload.planted(2.0, {"cx": 0.03, "cy": -0.02, "cz": 0.1})


@pytest.fixture(scope="module")
def branched() -> Robot:
    return next(r for r in map(random_robot, range(40)) if len(leaves(r)) > 1)


def carried(robot: Robot, joint: int) -> str:
    """A link that a moved joint carries."""
    first = int(robot.model.njoints) - robot.n
    return next(
        str(f.name)
        for f in robot.model.frames
        if f.parentJoint == first + joint and str(f.name) not in robot.model.names
    )


@pytest.mark.parametrize("leaf", [0, -1])
def test_its_columns_are_those_of_the_body_that_carries_it(branched: Robot, leaf: int) -> None:
    joint = leaves(branched)[leaf]
    signals = signals_of(branched)
    phi = standard_parameters(branched)
    at = 10 * (branched.n_bodies - branched.n + joint)
    phi[at : at + 10] += SPHERE
    heavier = RigidBody(branched, phi, signals.q, signals.v, signals.a).load
    added = Payload((joint,)).torque(signals, SPHERE)
    assert np.abs(added).max() > 1e-3
    assert heavier - signals.load == pytest.approx(added, abs=1e-9)


def test_every_leaf_is_looked_at_and_any_link_may_be_named(branched: Robot) -> None:
    places = [(j,) for j in leaves(branched)]
    assert Payload.places(branched) == places
    assert places_named(Payload, ("all",), branched, "x") == places
    link = carried(branched, leaves(branched)[0])
    (planted,) = parse_planted(f"payload@{link}=1.5", branched, {})
    assert planted.effect.joints == (leaves(branched)[0],)
    (declared,) = declared_effects((EffectSpec(kind="payload", joints=(link,)),), branched)
    assert declared.joints == (leaves(branched)[0],)


def test_a_name_of_nothing_is_refused_with_links_to_choose_from(branched: Robot) -> None:
    with pytest.raises(ConfigError, match="or the name of a link"):
        places_named(Payload, ("no_such",), branched, "here")
    with pytest.raises(ConfigError, match="no moved joint carries link"):
        link_frame(branched, "link_0", "here")


def test_files_of_earlier_versions_name_all_joints_and_mean_the_last(branched: Robot) -> None:
    signals = signals_of(branched)
    every = Payload(tuple(range(branched.n))).columns(signals)
    assert np.array_equal(every, Payload((branched.n - 1,)).columns(signals))


def test_numbers_are_told_in_the_frame_of_the_named_link() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    link = LinkFrame("gripper", 0, turn, np.array([0.0, 0.0, 0.08]))
    seen = Payload((0,)).seen_from(link) @ SPHERE
    centre = turn.T @ (np.array([0.03, -0.02, 0.1]) - link.translation)
    expected = Payload.planted(2.0, dict(zip(("cx", "cy", "cz"), centre, strict=True)))[1]
    assert seen == pytest.approx(expected, abs=1e-12)


def test_the_first_named_link_on_the_joint_tells(branched: Robot) -> None:
    joint = leaves(branched)[-1]
    link = carried(branched, joint)
    told = told_on(Payload((joint,)), branched, (carried(branched, leaves(branched)[0]), link))
    assert told is not None
    assert told.name == link
    assert told_on(CoulombFriction((joint,)), branched, (link,)) is None


def test_moving_there_and_back_changes_nothing() -> None:
    turn: Array = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = np.array([0.1, -0.2, 0.3])
    there, back = moved(turn, shift), moved(turn.T, -turn.T @ shift)
    assert back @ there == pytest.approx(np.eye(10), abs=1e-12)
