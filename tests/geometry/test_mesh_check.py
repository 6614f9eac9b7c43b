"""The true meshes along a motion, against coal asked for every pair at every instant."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.geometry.link_meshes import Poses, link_meshes
from excite_cli.geometry.mesh_check import MeshCheck
from excite_cli.geometry.mesh_distances import MeshDistances
from excite_cli.geometry.mesh_pairs import RelativeReach, ball_bounds, hull_bounds
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.robot.model import Array, Robot, build_robot
from tests.geometry.mesh_cover import uncovered_links
from tests.robot.coupled_robots import CLAW, coupled_robot
from tests.robot.smoke_arm import ARM

from .fitted_robots import capsules_of, robot_of


def arm() -> Robot:
    posture = {"shoulder_pitch": 0.6, "elbow": 0.8, "slide": 0.05}
    return build_robot(RobotSpec(urdf=str(ARM), posture=posture))


def wave(robot: Robot, count: int, seed: int = 0) -> Array:
    """A smooth motion over most of the limits, (count, n)."""
    lower, upper = robot.limits.ranges()
    t = np.linspace(0, 2 * np.pi, count)[:, None]
    rng = np.random.default_rng(seed)
    phase, beat = rng.uniform(0, 6, robot.n), rng.integers(1, 4, robot.n)
    return (lower + upper) / 2 + 0.48 * (upper - lower) * np.sin(beat * t + phase)


@pytest.mark.parametrize(("name", "count"), [("arm", 300), ("panda", 40), ("claw", 40)])
@pytest.mark.parametrize("smooth", [True, False])
def test_least_distances_and_counts_are_those_of_brute_force(
    name: str, count: int, smooth: bool
) -> None:
    named = {"arm": arm, "claw": lambda: coupled_robot(CLAW, posture={"knuckle": 0.3})}
    robot = named[name]() if name in named else robot_of(name)
    check = MeshCheck(robot)
    q = wave(robot, count) if smooth else robot.draw_states(count, 8)[0]
    found = check.least(q)
    near = {(gap.first, gap.second): gap for gap in found.near}
    brute = MeshDistances(robot)
    touched = 0
    for pair in check.pairs:
        names = check.names(pair)
        true = np.array([brute.distance([names[0]], [names[1]], at) for at in q])
        if names not in near:
            assert true.min() >= found.beyond - 2e-6
            continue
        gap = near[names]
        # How deep meshes are in each other coal does not say for sure.
        assert max(gap.distance, 0) == pytest.approx(max(true.min(), 0), abs=2e-6)
        assert max(true[gap.index], 0) == pytest.approx(max(true.min(), 0), abs=2e-6)
        assert gap.touching == np.count_nonzero(true <= 0)
        assert gap.broken == (gap.touching > 0)
        touched += gap.touching
    assert touched > 0, "this test asks for motions that touch"
    assert found.broken == tuple(gap for gap in found.near if gap.touching)


def test_blocks_of_instants_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    check, q = MeshCheck(arm()), wave(arm(), 200)
    whole = check.least(q)
    monkeypatch.setattr("excite_cli.geometry.mesh_check._BLOCK", 37)
    for one, two in zip(whole.near, check.least(q).near, strict=True):
        assert (one.first, one.second, one.touching) == (two.first, two.second, two.touching)
        assert one.distance == pytest.approx(two.distance, abs=2e-6)


def test_bounds_never_exceed_the_distance() -> None:
    robot = robot_of("panda")
    q = robot.draw_states(25, 4)[0]
    poses, meshes, brute = Poses.of(robot, q), link_meshes(robot), MeshDistances(robot)
    sharp = 0
    for i, j in [(0, 4), (1, 5), (2, 8), (3, 9), (0, 8)]:
        true = np.array([brute.distance([meshes[i].link], [meshes[j].link], at) for at in q])
        balls = ball_bounds(poses, meshes, np.array([[i, j]]))[0]
        hulls = hull_bounds(poses, (meshes[i], meshes[j]), np.arange(len(q)), np.full(len(q), 9.0))
        assert np.all(balls <= true + 1e-9)
        assert np.all(hulls <= true + 1e-9)
        sharp += np.count_nonzero(hulls > 0.9 * true)
    assert sharp > 60  # of 125: else the bounds are valid but useless


def test_a_link_moves_no_farther_than_its_reach_seen_from_another() -> None:
    rng = np.random.default_rng(5)
    for robot, names in (
        (arm(), ("column", "tool")),
        (robot_of("talos"), ("arm_left_6_link", "arm_right_3_link")),
        (robot_of("talos"), ("torso_2_link", "arm_left_4_link")),
        (coupled_robot(CLAW), ("left_outer", "right_outer")),
    ):
        meshes = {mesh.link: mesh for mesh in link_meshes(robot)}
        first, second = meshes[names[0]], meshes[names[1]]
        q = robot.draw_states(1, 7)[0]
        tightest = np.inf
        for size in (0.01, 0.1, 1.0):
            change = rng.uniform(0, size, (1, robot.n))
            middle = Poses.of(robot, q)
            bound = RelativeReach(robot).between(middle, first, second, change)[0]
            near = Poses.of(robot, q + rng.choice([-1.0, -0.5, 1.0], (300, robot.n)) * change)
            moved = min(
                np.linalg.norm(seen(near, one, two) - seen(middle, one, two), axis=2).max()
                for one, two in ((first, second), (second, first))
            )
            assert moved <= bound + 1e-12
            tightest = min(tightest, bound / moved)
        assert tightest < 3.0


def seen(poses: Poses, one: object, two: object) -> Array:
    """Corners of a link's box as seen from another (T, 8, 3)."""
    corners = poses.points(two.joint, two.box)  # type: ignore[attr-defined]
    turn = poses.rotations[:, one.joint]  # type: ignore[attr-defined]
    away = corners - poses.translations[:, one.joint][:, None]  # type: ignore[attr-defined]
    return np.asarray(np.einsum("txy,tcx->tcy", turn, away))


def test_what_is_proved_holds() -> None:
    robot = arm()
    check = MeshCheck(robot)
    q = robot.draw_states(60, 2)[0]
    change = np.full(q.shape, 0.05)
    proof = check.proved(q, change=change)
    brute = MeshDistances(robot)
    rng = np.random.default_rng(1)
    assert 0.3 < proof.proved.mean() < 1.0
    for p, pair in enumerate(check.judged):
        names = check.names(pair)
        for k in range(0, len(q), 3):
            moved = q[k] + rng.uniform(-1, 1, (4, robot.n)) * change[k]
            true = min(brute.distance([names[0]], [names[1]], at) for at in moved)
            assert true >= proof.distance[k, p]
            if proof.broken[k, p]:
                assert brute.distance([names[0]], [names[1]], q[k]) <= 0
    # The same from the motion of each link in the world, which is seldom less.
    meshes = check.meshes
    reach = np.empty((len(q), len(meshes)))
    for k in range(len(q)):
        near = Poses.of(robot, np.vstack([q[k], q[k] + rng.uniform(-1, 1, (50, robot.n)) * 0.05]))
        for m, mesh in enumerate(meshes):
            corners = near.points(mesh.joint, mesh.box)
            reach[k, m] = np.linalg.norm(corners - corners[0], axis=2).max()
    in_the_world = check.proved(q, reach)
    assert 0.3 < in_the_world.proved.mean() < 1.0
    assert not (in_the_world.broken & proof.proved).any()
    both = check.proved(q, reach, change)
    assert np.array_equal(both.proved, in_the_world.proved | proof.proved)
    asked = np.zeros(proof.proved.shape, dtype=bool)
    asked[::2, 0] = True
    part = check.proved(q, change=change, asked=asked)
    assert np.array_equal(part.proved, proof.proved & asked)


def test_a_margin_is_kept_too() -> None:
    check = MeshCheck(arm())
    q = check_posture = arm().posture[None]
    still = np.zeros_like(check_posture)
    least = min(check.distances(q, *check.names(pair))[0] for pair in check.judged)
    assert check.proved(q, change=still, margin=least - 1e-4).proved.all()
    beyond = check.proved(q, change=still, margin=least + 1e-4)
    assert beyond.broken.sum() == 1
    assert not beyond.proved.all()


def test_pairs_that_are_not_judged() -> None:
    robot = robot_of("talos")
    check = MeshCheck(robot, ignore=[("arm_left_5_link", "torso_2_link")])
    always = {frozenset(check.names(pair)) for pair in check.always}
    assert always == {
        frozenset((f"arm_{side}_5_link", f"arm_{side}_7_link")) for side in ("left", "right")
    }
    assert all(pair.standing is ContactMeaning.ALWAYS_TOUCHING for pair in check.always)
    names = {frozenset(check.names(pair)) for pair in check.pairs}
    assert frozenset(("arm_left_5_link", "torso_2_link")) not in names  # ignored
    assert frozenset(("arm_left_5_link", "arm_left_4_link")) not in names  # adjacent
    assert frozenset(("leg_left_3_link", "leg_right_3_link")) not in names  # both stand still
    assert frozenset(("arm_left_5_link", "wrist_left_ft_link")) in names


def test_contact_of_links_by_hand_and_at_the_posture_is_told_only() -> None:
    robot = arm()
    q = wave(robot, 200)
    broken = {frozenset((gap.first, gap.second)) for gap in MeshCheck(robot).least(q).broken}
    assert frozenset(("base", "tool")) in broken
    check = MeshCheck(robot, by_hand=["tool"])
    told = [gap for gap in check.least(q).near if "tool" in (gap.first, gap.second)]
    assert told[0].touching > 0
    assert all(gap.standing is ContactMeaning.BY_HAND and not gap.broken for gap in told)
    judge = MeshCheck(robot)
    touching = next(at for at in q if judge.least(at[None]).broken)
    posture = dict(zip(robot.joint_names, map(float, touching), strict=True))
    there = MeshCheck(build_robot(RobotSpec(urdf=str(ARM), posture=posture)))
    assert any(pair.standing is ContactMeaning.AT_POSTURE for pair in there.pairs)
    assert not there.least(touching[None]).broken


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_capsules_contain_the_meshes(name: str) -> None:
    """And what is too small is found."""
    robot, capsules = robot_of(name), list(capsules_of(name))
    assert not uncovered_links(robot, tuple(capsules))
    if name == "panda":
        return
    number = next(k for k, one in enumerate(capsules) if one.name == "forearm_link#2")
    one = capsules[number]
    capsules[number] = replace(one, radius=one.radius - 2e-4)
    found = uncovered_links(robot, tuple(capsules))
    assert [entry.link for entry in found] == ["forearm_link"]
    assert 5e-5 < found[0].distance < 3e-4
    del capsules[number]
    assert uncovered_links(robot, tuple(capsules))[0].distance > 1e-3
    without = tuple(c for c in capsules if "forearm_link" not in c.links)
    assert uncovered_links(robot, without)[0].distance == np.inf
