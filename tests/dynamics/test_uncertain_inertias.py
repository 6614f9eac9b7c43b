"""Bounds on functionals of uncertain inertias against vertices and exact programs."""

from dataclasses import replace
from itertools import product

import clarabel
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_matrix

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import BodyUncertaintySpec, UncertaintySpec
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.least_ratio import least_ratios
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.uncertain_inertias import (
    FitKnowledge,
    InertiaUncertainty,
    Piece,
    box,
    half_widths,
    inertia_uncertainty,
)
from excite_cli.dynamics.whole_robot import GroundWrench, drawn_states, whole_parameters
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.gradient_check import central_differences
from excite_cli.robot.model import Array, Robot, build_robot
from tests.dynamics.drawn_bodies import drawn_bodies
from tests.robot.random_robots import random_robot

SPEC = UncertaintySpec(mass=0.2, center_of_mass=0.02, inertia=0.3)


def knowledge(robot: Robot, base: BaseParameters, seed: int, precision: float) -> FitKnowledge:
    """A fit near the URDF, its covariance `precision`² of the box's spread, correlated."""
    rng = np.random.default_rng(seed)
    reach = box(SPEC, robot)[10:]
    usual = np.sqrt(np.square(base.mapping) @ np.square(reach))
    root = precision * usual[:, None] * (np.eye(base.rank) + 0.3 * rng.normal(size=[base.rank] * 2))
    values = base.mapping @ (whole_parameters(robot)[10:] + 0.3 * rng.uniform(-reach, reach))
    names = tuple(base.names[index] for index in base.selection)
    return FitKnowledge(values, root @ root.T, names, robot.fingerprint(), "fit.h5")


def fitted(
    seed: int, precision: float, joints: int = 3, **more: object
) -> tuple[Robot, BaseParameters, FitKnowledge, Array]:
    """A robot, its base parameters, a fit of them, and their rows over all inertias."""
    robot = random_robot(seed, joints=joints, **more)
    base = find_base_parameters(robot)
    rows = np.hstack([np.zeros((base.rank, 10)), base.mapping])
    return robot, base, knowledge(robot, base, seed, precision), rows


def exact_least(
    y: Array, phi: Array, reach: Array, mapping: Array, fit: FitKnowledge, sigmas: float
) -> float:
    """min y·φ over box and ellipsoid, as a second-order cone program."""
    size, rank = len(y), len(fit.values)
    whiten = np.linalg.inv(np.linalg.cholesky(fit.covariance))
    rows = np.vstack(
        [np.eye(size), -np.eye(size), np.zeros((1, size)), -whiten @ (mapping * reach)]
    )
    gap = whiten @ (mapping @ phi - fit.values)
    right = np.concatenate([np.ones(2 * size), [sigmas], gap])
    cones = [clarabel.NonnegativeConeT(2 * size), clarabel.SecondOrderConeT(rank + 1)]
    quiet = clarabel.DefaultSettings()
    quiet.verbose = False
    solver = clarabel.DefaultSolver(
        csc_matrix((size, size)), y * reach, csc_matrix(rows), right, cones, quiet
    )
    return float(y @ phi + solver.solve().obj_val)


def test_half_widths_by_hand() -> None:
    """2 kg at (0.1, −0.2, 0) m, 0.4, 0.68 and 0.8 kg·m² about it; ± 10 %, 1 cm, 20 %."""
    ten = np.array([2.0, 0.2, -0.4, 0.0, 0.48, 0.04, 0.7, 0.0, 0.0, 0.9])
    bound = BodyUncertaintySpec(mass=0.1, center_of_mass=0.01, inertia=0.2)
    first = [2.2 * 0.01 + 0.1 * 0.2, 2.2 * 0.01 + 0.1 * 0.4, 2.2 * 0.01]
    about_x = 0.2 * 0.4 + (2.2 * (0.21**2 + 0.01**2) - 2.0 * 0.2**2)
    about_z = 0.2 * 0.8 + (2.2 * (0.11**2 + 0.21**2) - 2.0 * 0.05)
    beside = 0.2 * (0.4 + 0.68) / 2 + (2.2 * 0.11 * 0.21 - 2.0 * 0.1 * 0.2)
    found = half_widths(ten, bound)
    assert np.allclose(found[:4], [0.2, *first])
    assert found[4] == pytest.approx(about_x)
    assert found[5] == pytest.approx(beside)
    assert found[9] == pytest.approx(about_z)


@pytest.mark.parametrize("seed", range(4))
def test_no_body_within_the_words_is_outside_the_box(seed: int) -> None:
    robot = random_robot(seed, joints=4)
    phi = whole_parameters(robot)
    bodies = drawn_bodies(phi, SPEC, 3000, seed)
    reach = box(SPEC, robot)
    assert (np.abs(bodies - phi) <= reach * (1 + 1e-12) + 1e-12).all()
    used = reach > 1e-9
    most = np.abs(bodies - phi).max(axis=0)[used] / reach[used]
    assert np.median(most) > 0.8  # the box is not much larger than it must be


@settings(max_examples=20, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999))
def test_a_box_is_least_at_one_of_its_vertices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    center, reach = rng.normal(size=6), rng.uniform(0, 1, 6)
    admitted = InertiaUncertainty((Piece(center, reach, np.zeros((0, 6))),))
    vertices = center + np.array(list(product((-1.0, 1.0), repeat=6))) * reach
    y = rng.normal(size=(5, 6))
    assert np.allclose(admitted.least(y), (vertices @ y.T).min(axis=0))
    worst = admitted.worst(y)
    assert np.allclose(np.abs(worst - center), reach)
    assert np.allclose(np.einsum("kp,kp->k", y, worst), admitted.least(y))
    below, above = admitted.least_both(y)
    assert np.allclose(below, admitted.least(y))
    assert np.allclose(above, admitted.least(-y))


@settings(max_examples=15, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), heavy=st.floats(0.0, 0.6))
def test_quotients_are_least_at_a_vertex(seed: int, heavy: float) -> None:
    rng = np.random.default_rng(seed)
    center, reach = np.append(rng.normal(size=5), 1.0), np.append(rng.uniform(0, 1, 5), heavy)
    admitted = InertiaUncertainty((Piece(center, reach, np.zeros((0, 6))),))
    rows = np.zeros((1, 3, 6))
    rows[0, :2, :5], rows[0, 2, 5] = rng.normal(size=(2, 5)), 1.0
    rows[0, 2, :5] = 0.02 * rng.normal(size=5)
    above = rng.normal(size=(4, 3))
    vertices = center + np.array(list(product((-1.0, 1.0), repeat=6))) * reach
    values = vertices @ rows[0].T
    expected = ((values @ above.T) / values[:, 2:]).min(axis=0)
    found = least_ratios(admitted, rows, above, np.array([0.0, 0.0, 1.0]), 0.05)
    assert found.proper.all()
    assert np.allclose(found.values[0], expected, rtol=1e-9)


@pytest.mark.parametrize(("seed", "precision"), [(0, 0.02), (1, 0.2), (2, 1.0)])
def test_bounds_after_a_fit_are_sound_and_near_the_exact_program(
    seed: int, precision: float
) -> None:
    more = {"floating": seed == 1, "rows": ("joints",)}
    robot, base, fit, mapping = fitted(seed, precision, 4, **more)
    admitted = inertia_uncertainty(SPEC, robot, base, fit)
    phi, reach = whole_parameters(robot), admitted.pieces[0].corners
    states = drawn_states(robot, 4, seed)
    torques = Regressor(replace(robot, rows=robot.moved)).evaluate(states.q, states.v, states.a)
    torques = np.pad(torques, ((0, 0), (0, 0), (10, 0)))
    for rows, loosest in ((torques, 0.2), (GroundWrench(robot).regressor(states), 0.3)):
        y = rows.reshape(-1, len(phi))[:: 2 if rows is torques else 3]
        low, high = admitted.least_both(y)
        exact = [exact_least(row, phi, reach, mapping, fit, SPEC.sigmas) for row in y]
        above = [exact_least(-row, phi, reach, mapping, fit, SPEC.sigmas) for row in y]
        width = -np.array(above) - exact
        assert np.all(low <= exact + 1e-5 * width)
        assert np.all(high <= above + 1e-5 * width)
        lost = (-high - low) / width - 1.0
        assert np.median(lost) < loosest
        sharp = admitted.sharpest(y)
        assert np.all(sharp.least(y) <= low + 1e-12 * np.abs(low))
        assert np.median((sharp.least(y) - low) / width) > -0.05


def test_a_good_fit_opens_the_set_and_a_bad_one_leaves_the_box() -> None:
    robot = random_robot(3, joints=4)
    base = find_base_parameters(robot)
    states = drawn_states(robot, 10)
    y = Regressor(robot).evaluate(states.q, states.v, states.a).reshape(-1, 40)
    prior = inertia_uncertainty(SPEC, robot, base).of_moving_bodies()

    def width(admitted: InertiaUncertainty) -> float:
        below, above = admitted.least_both(y)
        return float(np.mean(-above - below))

    good, poor = (
        inertia_uncertainty(SPEC, robot, base, knowledge(robot, base, 0, precision))
        for precision in (0.01, 100.0)
    )
    assert width(good.of_moving_bodies()) < 0.1 * width(prior)
    assert np.isclose(width(poor.of_moving_bodies()), width(prior), rtol=1e-3)


def test_the_derivative_of_a_bound_is_its_worst_inertia() -> None:
    robot, base, fit, _ = fitted(4, 0.1)
    admitted = inertia_uncertainty(SPEC, robot, base, fit)
    for y in np.random.default_rng(0).normal(size=(4, 40)):
        expected = central_differences(lambda x: float(admitted.least(x)), y, 1e-7)
        assert np.allclose(admitted.worst(y[None])[0], expected, atol=1e-5)
        assert np.isclose(admitted.worst(y[None])[0] @ y, admitted.least(y))


def test_what_the_data_did_not_show_is_left_to_the_box() -> None:
    robot, base, fit, y = fitted(5, 0.05)
    covariance = fit.covariance.copy()
    covariance[2] = covariance[:, 2] = 0.0
    covariance[2, 2] = np.inf
    unseen = inertia_uncertainty(SPEC, robot, base, replace(fit, covariance=covariance))
    seen = inertia_uncertainty(SPEC, robot, base, fit)
    below, above = unseen.least_both(y)
    assert np.all(np.isfinite(below))
    width, known = -above - below, -np.add(*seen.least_both(y))
    assert width[2] > 3 * known[2]
    assert width[0] < 1.5 * known[0]


def test_a_fit_outside_the_box_widens_it() -> None:
    robot, base, fit, y = fitted(6, 0.01)
    truth = 1.6 * whole_parameters(robot)
    admitted = inertia_uncertainty(SPEC, robot, base, replace(fit, values=y @ truth))
    below, above = admitted.least_both(y)
    assert np.all(below <= y @ truth + 1e-9)
    assert np.all(y @ truth <= -above + 1e-9)
    deviations = np.sqrt(np.diag(fit.covariance))
    assert np.all(-above - below < 2.02 * SPEC.sigmas * deviations)


@pytest.mark.parametrize("precision", [0.003, 0.1])
@pytest.mark.parametrize("off", [1.15, 1.6, 3.0])
def test_a_fit_that_contradicts_the_box_leaves_something_admitted(
    precision: float, off: float
) -> None:
    """Otherwise bounds would be bounds over an empty set: the least above the largest."""
    robot, base, fit, mapping = fitted(8, precision, 4)
    phi = whole_parameters(robot)
    fit = replace(fit, values=mapping @ (off * phi))
    admitted = inertia_uncertainty(SPEC, robot, base, fit)
    states = drawn_states(robot, 10)
    y = np.pad(Regressor(robot).evaluate(states.q, states.v, states.a), ((0, 0), (0, 0), (10, 0)))
    y = y.reshape(-1, y.shape[-1])
    below, above = admitted.least_both(y)
    assert np.all(below <= -above)
    reach = admitted.pieces[0].corners
    assert np.isfinite(exact_least(y[0], phi, reach, mapping, fit, SPEC.sigmas))


def test_fits_that_cannot_be_followed_are_refused() -> None:
    """Bounds of zero would admit nothing, and bounds over nothing would prove anything."""
    robot, base, fit, mapping = fitted(9, 0.01)
    heavier = replace(fit, values=mapping @ (1.5 * whole_parameters(robot)))
    stiff = UncertaintySpec(mass=0.0, center_of_mass=0.0, inertia=0.0)
    with pytest.raises(ConfigError, match="some bounds are zero"):
        inertia_uncertainty(stiff, robot, base, heavier)
    assert len(inertia_uncertainty(SPEC, robot, base, heavier).pieces) > 1
    with pytest.raises(FileError, match=r"fit.h5 was made for another robot"):
        inertia_uncertainty(SPEC, robot, base, fitted(8, 1.0)[2])


def test_bodies_are_named_by_joint_link_or_base() -> None:
    """Unknown and locked ones are told."""
    exact = BodyUncertaintySpec(mass=0.0, center_of_mass=0.0, inertia=0.0)

    def exact_ones(robot: Robot, *names: str) -> list[int]:
        reach = box(UncertaintySpec(bodies=dict.fromkeys(names, exact)), robot).reshape(-1, 10)
        return np.flatnonzero(reach.sum(axis=1)).tolist()

    robot = random_robot(7, joints=3)
    assert exact_ones(robot, "base", "joint_2") == [1, 3]
    assert exact_ones(robot, "link_0", "link_2") == [1, 3]
    assert exact_ones(random_robot(7, joints=3, floating=True), "base") == [2, 3, 4]
    moved = ("elbow_joint", "wrist_1_joint")
    arm = build_robot(RobotSpec(urdf="example-robot-data:ur10", joints=moved))
    with pytest.raises(ConfigError, match=r"no moved joint 'elbow_join'. Did you mean 'elbow_joi"):
        exact_ones(arm, "elbow_join")
    with pytest.raises(ConfigError, match=r"'wrist_2_joint'. It is locked.* Bodies: base, elbow"):
        exact_ones(arm, "wrist_2_joint")


def test_of_an_improper_quotient_the_least_over_the_floor_stands() -> None:
    admitted = InertiaUncertainty((Piece(np.ones(2), np.array([0.5, 2.0]), np.zeros((0, 2))),))
    found = least_ratios(
        admitted, np.eye(2)[None], np.array([[1.0, 0.0]]), np.array([0.0, 1.0]), 0.05
    )
    assert not found.proper.any()
    assert found.values == pytest.approx(np.array([[0.5 / 0.05]]))
