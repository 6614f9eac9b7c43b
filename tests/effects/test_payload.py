"""A payload on any leaf or link: its columns, the numbers told of it, and what is no body."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.dynamics.pseudo_inertia import moved
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import declared_effects
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.judgement import Seen
from excite_cli.effects.payload import Payload
from excite_cli.effects.placing import places_named, told_on
from excite_cli.errors import ConfigError
from excite_cli.robot.link_frame import LinkFrame, leaves, link_frame
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.ground_truth import parse_planted
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

_, SPHERE = Payload.planted(2.0, {"cx": 0.03, "cy": -0.02, "cz": 0.1})
BRANCHED = next(r for r in map(random_robot, range(40)) if len(leaves(r)) > 1)


def carried(robot: Robot, joint: int) -> str:
    """A link that a moved joint carries."""
    first = int(robot.model.njoints) - robot.n
    return next(
        str(f.name)
        for f in robot.model.frames
        if f.parentJoint == first + joint and str(f.name) not in robot.model.names
    )


@pytest.mark.parametrize("leaf", [0, -1])
def test_its_columns_are_those_of_the_body_that_carries_it(leaf: int) -> None:
    joint = leaves(BRANCHED)[leaf]
    signals = signals_of(BRANCHED)
    phi = standard_parameters(BRANCHED)
    at = 10 * (BRANCHED.n_bodies - BRANCHED.n + joint)
    phi[at : at + 10] += SPHERE
    heavier = RigidBody(BRANCHED, phi, signals.q, signals.v, signals.a).load
    added = Payload((joint,)).torque(signals, SPHERE)
    assert np.abs(added).max() > 1e-3
    assert heavier - signals.load == pytest.approx(added, abs=1e-9)


def test_every_leaf_is_looked_at_and_any_link_may_be_named() -> None:
    places = [(j,) for j in leaves(BRANCHED)]
    assert Payload.places(BRANCHED) == places
    assert places_named(Payload, ("all",), BRANCHED, "x") == places
    link = carried(BRANCHED, leaves(BRANCHED)[0])
    (planted,) = parse_planted(f"payload@{link}=1.5", BRANCHED, {})
    assert planted.effect.joints == (leaves(BRANCHED)[0],)
    (declared,) = declared_effects((EffectSpec(kind="payload", joints=(link,)),), BRANCHED)
    assert declared.joints == (leaves(BRANCHED)[0],)
    # A name of nothing is refused with links to choose from.
    with pytest.raises(ConfigError, match="or the name of a link"):
        places_named(Payload, ("no_such",), BRANCHED, "here")
    with pytest.raises(ConfigError, match="no moved joint carries link"):
        link_frame(BRANCHED, "link_0", "here")


def test_numbers_are_told_in_the_frame_of_the_named_link() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    link = LinkFrame("gripper", 0, turn, np.array([0.0, 0.0, 0.08]))
    seen = Payload((0,)).seen_from(link) @ SPHERE
    centre = turn.T @ (np.array([0.03, -0.02, 0.1]) - link.translation)
    expected = Payload.planted(2.0, dict(zip(("cx", "cy", "cz"), centre, strict=True)))[1]
    assert seen == pytest.approx(expected, abs=1e-12)
    # The first named link on the joint tells.
    joint = leaves(BRANCHED)[-1]
    link = carried(BRANCHED, joint)
    told = told_on(Payload((joint,)), BRANCHED, (carried(BRANCHED, leaves(BRANCHED)[0]), link))
    assert told is not None
    assert told.name == link
    assert told_on(CoulombFriction((joint,)), BRANCHED, (link,)) is None
    # Files of earlier versions name all joints and mean the last.
    signals = signals_of(BRANCHED)
    every = Payload(tuple(range(BRANCHED.n))).columns(signals)
    assert np.array_equal(every, Payload((BRANCHED.n - 1,)).columns(signals))


def test_moving_there_and_back_changes_nothing() -> None:
    turn: Array = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = np.array([0.1, -0.2, 0.3])
    there, back = moved(turn, shift), moved(turn.T, -turn.T @ shift)
    assert back @ there == pytest.approx(np.eye(10), abs=1e-12)


def test_what_hangs_too_far_off_or_weighs_nothing_is_no_payload() -> None:
    seen = Seen(np.ones(2), np.ones(2), 30.0, reach=0.9)
    load = Payload((1,), {}, ())
    assert load.absurd(Payload.planted(1.5, {"cz": 0.3})[1], seen) == ""
    assert "1.8 m off" in load.absurd(Payload.planted(1.5, {"cz": 1.8})[1], seen)
    assert "next to nothing" in load.absurd(Payload.planted(0.003, {"cz": 1.8})[1], seen)
