"""The compiled inner loops against the NumPy forms that stand in for them, and against scipy."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RectBivariateSpline

from excite_cli.dynamics import forward_kinematics, spatial_adjoint
from excite_cli.dynamics.forward_kinematics import BatchKinematics
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint
from excite_cli.excitation import task
from excite_cli.excitation.task import ResidualDerivatives, squared_per_instant
from excite_cli.geometry import pair_distances
from excite_cli.geometry.mesh_pairs import PairTable
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.kernels import compiled as kernels
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import random_robot

ROBOTS = st.tuples(st.integers(0, 10_000), st.integers(2, 9), st.booleans())
pytestmark = pytest.mark.skipif(
    KERNELS is None and shutil.which("cc") is None, reason="no C compiler on this machine"
)


def test_they_were_compiled() -> None:
    assert KERNELS is not None, "the package was installed without its C file: pip install -e ."


def test_a_library_of_another_version_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "_VERSION", -1)
    assert kernels._loaded() is None


COUPLED = [coupled_robot(HAND), coupled_robot(CLAW, base="floating")]


@settings(max_examples=25, deadline=None, derandomize=True)
@given(ROBOTS)
def test_loops_over_random_robots(chosen: tuple[int, int, bool]) -> None:
    seed, joints, floating = chosen
    _assert_alike(random_robot(seed, joints, floating), seed)


@pytest.mark.parametrize("robot", COUPLED, ids=["hand", "claw"])
def test_loops_where_joints_follow(robot: Robot) -> None:
    _assert_alike(robot, 1)


def _assert_alike(robot: Robot, seed: int) -> None:
    _assert_pull_back(robot, seed)
    _assert_regressor(robot, seed)
    _assert_distances(robot, seed)


def _assert_pull_back(robot: Robot, seed: int) -> None:
    q, v, a = robot.draw_states(7, seed)
    weights = np.random.default_rng(seed).normal(size=(7, len(robot.rows), 10 * robot.n_bodies))
    kinematics, adjoint = BatchKinematics(robot), SpatialAdjoint(robot)
    placed = kinematics.placements(q)
    compiled = (*placed, kinematics.axes(*placed), *adjoint.pull_back_dense(q, v, a, weights))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forward_kinematics, "KERNELS", None)
        patch.setattr(spatial_adjoint, "KERNELS", None)
        placed = kinematics.placements(q)
        plain = (*placed, kinematics.axes(*placed), *adjoint.pull_back_dense(q, v, a, weights))
    for one, other in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-11 * (1 + np.abs(other).max()))


def _assert_regressor(robot: Robot, seed: int) -> None:
    states = robot.draw_states(7, seed)
    kept = np.random.default_rng(seed).permutation(10 * robot.n_bodies)[: 4 * robot.n_bodies]
    found = SpatialAdjoint(robot).regressor(*states, kept)
    known = Regressor(robot).evaluate(*states)[:, :, kept]
    np.testing.assert_allclose(found, known, atol=1e-12 * (1 + np.abs(known).max()))


def _assert_distances(robot: Robot, seed: int) -> None:
    rng = np.random.default_rng(seed)
    capsules = [
        Capsule(f"link_{joint}", joint, *rng.uniform(-0.3, 0.3, (2, 3)), 0.05, ())
        for joint in range(robot.model.njoints)
    ]
    # A ball, one axis twice (they coincide: no direction), and every pair.
    capsules.append(Capsule("ball", 1, capsules[1].start, capsules[1].start, 0.02, ()))
    capsules.append(Capsule("double", 1, capsules[1].start, capsules[1].end, 0.03, ()))
    pairs = [(i, j) for i in range(len(capsules)) for j in range(i)]
    measure = PairDistances(robot, capsules, pairs)
    q, _, _ = robot.draw_states(5, seed)
    rows, cols = (part.ravel() for part in np.indices((5, len(pairs))))

    def all_of() -> tuple[np.ndarray, ...]:
        near = measure.distances(q, exact_below=0.3)
        some = measure.gradients(q, rows.astype(np.int32), cols.astype(np.int32))
        return measure.distances(q), near, some

    compiled = all_of()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pair_distances, "KERNELS", None)
        plain = all_of()
    assert np.isfinite(compiled[2]).all()
    for one, other in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 10_000))
def test_bicubic_is_scipys(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grids = tuple(np.sort(rng.uniform(-2, 2, size)) for size in rng.integers(4, 20, 2))
    values = rng.normal(size=[len(grid) for grid in grids])
    table = PairTable("a", "b", (1, 0), grids, values, 0.0, 0.0)
    outside = rng.uniform(-2.5, 2.5, (40, 2))
    q = np.vstack([outside, [[grids[1][0], grids[0][0]], [grids[1][-1], grids[0][-1]]]])
    x, y = (np.clip(q[:, j], g[0], g[-1]) for j, g in zip((1, 0), grids, strict=True))
    spline = RectBivariateSpline(*grids, values)
    found = np.column_stack([table.distances(q), table.slopes(q)])
    known = np.column_stack([spline.ev(x, y), spline.ev(x, y, dx=1), spline.ev(x, y, dy=1)])
    np.testing.assert_allclose(found, known, atol=1e-8 * (1 + np.abs(known).max()))


def test_squares_per_instant(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    times = np.sort(rng.integers(0, 6, 40))
    parts = (rng.normal(size=(40, 3)), None, rng.normal(size=(40, 3)))
    rows, weights = ResidualDerivatives(times, np.zeros(40, int), parts), rng.uniform(size=40)
    compiled = squared_per_instant(rows, weights, 8)
    monkeypatch.setattr(task, "KERNELS", None)
    plain = squared_per_instant(rows, weights, 8)
    assert compiled.keys() == plain.keys()
    for pair in plain:
        np.testing.assert_allclose(compiled[pair], plain[pair], atol=1e-12)


def test_numpy_forms_can_be_asked_for() -> None:
    code = "from excite_cli.kernels.compiled import KERNELS; print(KERNELS)"
    environment = {**os.environ, "EXCITE_KERNELS": "numpy"}
    said = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert said.stdout.strip() == "None"
