import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from excite_cli.constraints.self_collision import Clearance
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.mesh_distances import Array, CoalDistances
from excite_cli.geometry.world_segments import nearest_points, normals
from excite_cli.robot.capsule import Capsule

from .fitted_robots import capsules_of, pairs_of, robot_of

Indices = NDArray[np.intp]
NAMES = ["talos", "ur10", "panda"]


class CoalGradients(CoalDistances):
    """`CoalDistances` with derivatives from its witness points, which are in millimetres."""

    def gradients(self, q: Array, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        configurations = self.robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(rows), self.robot.n))
        for t in np.unique(rows):
            self.measure(configurations[t])
            pin.computeJointJacobians(self.robot.model, self.data, configurations[t])
            for k in np.flatnonzero(rows == t):
                result[k] = self._gradient(int(cols[k]))
        return result

    def _gradient(self, pair: int) -> Array:
        answer = self.results[pair]
        normal = np.asarray(answer.normal).ravel()
        slopes = []
        for joint, point in zip(
            self.joints[pair], (answer.getNearestPoint1(), answer.getNearestPoint2()), strict=True
        ):
            wrench = np.concatenate([normal, np.cross(np.asarray(point).ravel() / 1000.0, normal)])
            columns = pin.getJointJacobian(
                self.robot.model, self.data, joint, pin.ReferenceFrame.WORLD
            )
            slopes.append(wrench @ columns if joint else np.zeros(self.robot.model.nv))
        return (slopes[1] - slopes[0])[self.robot.moved]


def spread(name: str) -> tuple[Clearance, CoalGradients, np.ndarray]:
    robot, capsules = robot_of(name), capsules_of(name)
    pairs = tuple(
        (i, j)
        for i in range(len(capsules))
        for j in range(i)
        if capsules[i].joint != capsules[j].joint
    )[::5]  # also touching ones: penetration must be right too
    chosen = CollisionPairs(pairs, ())
    q, _, _ = robot.draw_states(40, seed=4)
    return Clearance(robot, capsules, chosen), CoalGradients(robot, capsules, pairs), q


@pytest.mark.parametrize("name", NAMES)
def test_distances_and_gradients_equal_coal_and_differences(name: str) -> None:
    ours, coal, q = spread(name)
    distances = ours.distances(q)
    assert distances.shape == (40, ours.n_pairs)
    assert (distances < 0).any()
    np.testing.assert_allclose(distances, coal.distances(q), atol=1e-9)
    rng = np.random.default_rng(0)
    rows, cols = rng.integers(0, len(q), 120), rng.integers(0, ours.n_pairs, 120)
    np.testing.assert_allclose(ours.distances_at(q, rows, cols), distances[rows, cols], atol=1e-14)
    gradients = ours.gradients(q, rows, cols)
    np.testing.assert_allclose(gradients, coal.gradients(q, rows, cols), atol=1e-9)
    step = 1e-6
    for joint in range(q.shape[1]):
        shift = np.zeros(q.shape[1])
        shift[joint] = step
        numeric = (ours.distances(q + shift) - ours.distances(q - shift))[rows, cols] / (2 * step)
        np.testing.assert_allclose(gradients[:, joint], numeric, atol=1e-6)
    q[:] += 0.3  # in place: the kept placements must not be used
    assert np.abs(ours.distances(q) - distances).max() > 1e-3


def test_no_pairs() -> None:
    robot, capsules = robot_of("ur10"), capsules_of("ur10")
    empty = Clearance(robot, capsules, CollisionPairs((), ()))
    assert empty.distances(np.zeros((3, 6))).shape == (3, 0)
    none = np.zeros(0, dtype=np.intp)
    assert empty.gradients(np.zeros((3, 6)), none, none).shape == (0, 6)
    some = Clearance(robot, capsules, pairs_of("ur10"))
    first = pairs_of("ur10").checked[0]
    assert some.names[0] == tuple(capsules[k].name for k in first)
    assert len(some.names) == some.n_pairs


def test_continuous_through_contact_and_falling_beyond() -> None:
    robot = robot_of("ur10")
    place = np.array([1.0, 0.0, 0.0])
    distances = []
    for height in np.linspace(0.5, 0.0, 51):
        end = place + np.array([0, 0, height])
        capsules = (
            Capsule("low", 0, place, place + np.array([0.2, 0, 0]), 0.1, ("low",)),
            Capsule("high", 0, end, end + np.array([0, 0.2, 0]), 0.1, ("high",)),
        )
        pairs = CollisionPairs(((0, 1),), ())
        distances.append(Clearance(robot, capsules, pairs).distances(np.zeros((1, 6)))[0, 0])
    np.testing.assert_allclose(np.diff(distances), -0.01, atol=1e-12)
    assert distances[-1] == pytest.approx(-0.2)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["free", "parallel", "point", "points", "near"]))
def test_nearest_points_beat_a_fine_grid(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    p, a, q, b = rng.normal(size=(4, 3))
    if kind == "parallel":
        b = a * rng.uniform(-2, 2)
    elif kind == "near":
        b = a + 1e-8 * b
    elif kind == "point":
        b = np.zeros(3)
    elif kind == "points":
        a, b = np.zeros(3), np.zeros(3)
    nearest = nearest_points(*(x[:, None] for x in (p, a, q, b)))
    s, t = float(nearest.share_first[0]), float(nearest.share_second[0])
    assert 0 <= s <= 1
    assert 0 <= t <= 1
    np.testing.assert_allclose(nearest.gap[:, 0], q + t * b - p - s * a, atol=1e-12)
    grid = np.linspace(0, 1, 101)
    on_first, on_second = p + grid[:, None] * a, q + grid[:, None] * b
    brute = np.linalg.norm(on_first[:, None] - on_second[None], axis=-1).min()
    found = np.linalg.norm(nearest.gap)
    assert found <= brute + 1e-9
    assert brute - found < 0.05


def test_parallel_witnesses_lie_in_the_middle() -> None:
    p, a = np.zeros((3, 1)), np.array([[1.0], [0], [0]])
    q, b = np.array([[0.5], [1.0], [0]]), np.array([[1.0], [0], [0]])
    nearest = nearest_points(p, a, q, b)
    assert nearest.share_first[0] == pytest.approx(0.75)
    assert nearest.share_second[0] == pytest.approx(0.25)


@pytest.mark.parametrize("second", [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
def test_crossing_segments_have_a_unit_normal_at_right_angles(second: list[float]) -> None:
    first = np.array([[1.0], [0.0], [0.0]])
    other = np.array(second)[:, None]
    nearest = nearest_points(-first / 2, first, -other / 2, other)
    np.testing.assert_allclose(nearest.gap, 0.0, atol=1e-15)
    normal = normals(nearest, first, other)
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert abs(normal[:, 0] @ first[:, 0]) < 1e-12
    assert abs(normal[:, 0] @ other[:, 0]) < 1e-12


def test_gradients_are_finite_where_bodies_coincide() -> None:
    robot = robot_of("panda")
    zero, far = np.zeros(3), np.array([0.0, 0.0, 0.333])
    capsules = (
        Capsule("fixed", 0, far, far, 0.1, ("fixed",)),
        Capsule("turning", 1, zero, zero, 0.1, ("turning",)),
    )
    clearance = Clearance(robot, capsules, CollisionPairs(((0, 1),), ()))
    q = np.zeros((1, 7))
    assert clearance.distances(q)[0, 0] == pytest.approx(-0.2)
    assert np.isfinite(clearance.gradients(q, np.array([0]), np.array([0]))).all()


@pytest.mark.parametrize("name", ["talos", "ur10"])
def test_bounds_replace_only_what_is_far(name: str) -> None:
    robot = robot_of(name)
    clearance = Clearance(robot, capsules_of(name), pairs_of(name))
    q, v, a = robot.draw_states(40, 3)
    exact = clearance.distances(q)
    states = States(BatchKinematics(robot), q, v, a)
    found = clearance.distances(states, exact_below=0.1)
    near = exact < 0.1
    assert near.any()
    assert not near.all()
    assert np.allclose(found[near], exact[near], atol=1e-12)
    assert np.all(found[~near] >= 0.1)
    assert np.all(found <= exact + 1e-12)
