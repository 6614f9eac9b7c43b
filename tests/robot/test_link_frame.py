"""Leaves and branches of the tree of moved joints."""

from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.link_frame import branches, leaves
from tests.robot.random_robots import random_robot


def test_a_chain_is_one_branch() -> None:
    robot = random_robot(3, joints=4, branches=False, prismatic=False)
    assert branches(robot) == [(0, 1, 2, 3)]
    assert kind_named("torque_delay").places(robot) == [(0, 1, 2, 3), (0,), (1,), (2,), (3,)]


def test_a_branch_is_what_carries_one_leaf_alone() -> None:
    robot = next(r for r in map(random_robot, range(40)) if len(leaves(r)) > 1 and r.n > 3)
    model, first = robot.model, int(robot.model.njoints) - robot.n
    for leaf, branch in zip(leaves(robot), branches(robot), strict=True):
        path = {int(j) - first for j in model.supports[leaf + first] if int(j) >= first}
        others = set()
        for other in leaves(robot):
            if other != leaf:
                others |= {int(j) - first for j in model.supports[other + first]}
        assert set(branch) == path - others
    assert not set(branches(robot)[0]) & set(branches(robot)[1])
