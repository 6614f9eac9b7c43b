"""Joints in the posture, as Pinocchio places them, and what of a file is no skeleton."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.robot.model import Array, build_robot
from excite_cli.robot.tree import Skeleton, skeleton_of
from tests.cli.program import SMOKE


@pytest.fixture(scope="module")
def skeleton() -> Skeleton:
    return skeleton_of(build_robot(load_spec(SMOKE).robot, SMOKE.parent))


def test_a_chain_follows_its_parents_and_ends_in_a_tip(skeleton: Skeleton) -> None:
    n = len(skeleton.joints)
    assert skeleton.parents == tuple(range(-1, n - 1))
    assert skeleton.tips[:-1] == skeleton.joints[:-1]
    assert skeleton.fits(n)


def test_links_keep_their_length_in_another_posture(skeleton: Skeleton) -> None:
    robot = build_robot(load_spec(SMOKE).robot, SMOKE.parent)
    turned = skeleton_of(replace(robot, posture=np.full(robot.n, 0.3) * ~robot.sliding))

    def lengths(of: Skeleton) -> Array:
        return np.asarray(np.linalg.norm(np.diff(of.joints, axis=0), axis=1))

    turning = ~robot.sliding[1:]
    assert lengths(turned)[turning] == pytest.approx(lengths(skeleton)[turning])
    assert turned.joints != skeleton.joints


@pytest.mark.parametrize(
    "change",
    [{"parents": (0,)}, {"parents": (9, 0, 1, 2, 3)}, {"base": (float("nan"), 0.0, 0.0)}],
)
def test_what_is_no_skeleton_of_this_robot(skeleton: Skeleton, change: dict[str, object]) -> None:
    assert not replace(skeleton, **change).fits(len(skeleton.joints))  # type: ignore[arg-type]
