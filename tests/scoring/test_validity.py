"""The standard deviation of a predicted torque: where the data are, outside of them, by parameters.

Residuals drawn with a known size; the covariance of a fit; and a motion that took no part.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.model import Model
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.processing import Processing
from excite_cli.identification.regression import Series, effect_columns, signals_of, with_effects
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array
from excite_cli.scoring.validity import States, Trust, Validity, validity_of
from excite_cli.store.fit_file import read_fit
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop

RNG = np.random.default_rng(5)


@pytest.fixture(autouse=True)
def the_same_numbers() -> None:
    """Whichever tests ran before, on this worker or another."""
    RNG.bit_generator.state = np.random.default_rng(5).bit_generator.state


SIZE = 2000
FILTERED = Processing(500.0, 8.0, 4.0, 16.0, 1, 0.1, "central", 0.02, 1.0)


def trace(size: Array | float) -> TorqueTrace:
    """Speeds up to 1 rad/s, loads up to 10 N·m; a residual of `size` (SIZE,) on joint 1 of 2."""
    v = RNG.uniform(-1.0, 1.0, (SIZE, 2))
    load = RNG.uniform(-10.0, 10.0, (SIZE, 2))
    left = np.stack([size * RNG.normal(size=SIZE), 0.1 * RNG.normal(size=SIZE)], axis=1)
    t = 0.01 * np.arange(SIZE)
    every = np.ones((SIZE, 2), dtype=bool)
    return TorqueTrace("run", False, t, v, v, v, load, load + left, every, load)


def deviation(traces: list[TorqueTrace], v: float, load: float, d: float = 0.0) -> Array:
    return said(validity_of(traces, None), v=v, load=load, torque=load, d=d)


def said(validity: Validity, d: float = 0.0, **at: float) -> Array:
    """Deviations (2,) in a state of both joints; what is not given is 0."""
    zero = dict.fromkeys(("q", "v", "a", "load", "torque"), 0.0)
    states = States(**{name: np.full((1, 2), value) for name, value in (zero | at).items()})
    return validity.deviation(states, np.full((1, 2), d))[0]


def test_it_follows_what_is_left_over_speed_and_load() -> None:
    made = trace(0.0)
    size = np.sqrt(0.04 + np.square(made.v[:, 0]) + 0.01 * np.square(made.load[:, 0]))
    left = size * RNG.normal(size=SIZE)
    made = replace(made, measured=made.predicted + np.stack([left, 0.1 + 0 * left], axis=1))
    for v, load in ((0.1, 1.0), (0.9, 1.0), (0.1, 9.0), (0.9, 9.0)):
        expected = np.sqrt(0.2 * np.mean(size**2) + 0.8 * (0.04 + v**2 + 0.01 * load**2))
        assert deviation([made], v, load) == pytest.approx([expected, 0.1], rel=0.1)


def test_outside_of_the_data_it_grows_with_the_distance_and_by_parameters_everywhere() -> None:
    made = [trace(0.2)]
    inside = deviation(made, 0.5, 5.0)
    assert deviation(made, 3.0, 5.0)[0] > 2.9 * inside[0]
    assert deviation(made, 0.5, 40.0)[0] > 3.9 * inside[0]
    assert deviation(made, 0.5, 5.0, d=1.0) == pytest.approx(np.hypot(inside, 1.0))
    speeds, loads = validity_of(made, None).beyond(np.full((1, 2), 2.0), np.full((1, 2), 5.0))
    assert speeds == pytest.approx(np.full((1, 2), 2.0), rel=0.05)
    assert loads == pytest.approx(np.full((1, 2), 0.5), rel=0.05)
    away = validity_of(made, None).away(np.array([[0.0, 2.0]]))
    assert away == pytest.approx(np.array([[0.0, 2.0]]), abs=0.05)


def test_near_a_reversal_it_is_larger_the_longer_filters_smear_it() -> None:
    made = trace(0.0)
    a = RNG.uniform(-20.0, 20.0, (SIZE, 2))
    near = np.abs(made.v) < 0.1325 / 4.0 * np.abs(a)  # a Gaussian average of 4 Hz
    left = np.where(near, 1.0, 0.1) * RNG.normal(size=(SIZE, 2))
    validity = validity_of([replace(made, a=a, measured=made.predicted + left)], FILTERED)
    for slow, fast in ((0.05, 0.9), (-0.05, -0.9)):
        assert np.all(said(validity, v=slow, a=20.0) > 1.5 * said(validity, v=fast, a=20.0))
        assert np.all(said(validity, v=slow, a=20.0) > 1.5 * said(validity, v=slow, a=0.0))


def test_what_held_out_data_left_more_is_expected_everywhere() -> None:
    training, other = trace(0.2), trace(0.2)
    left = 2.0 * (other.measured - other.predicted)
    other = replace(other, measured=other.predicted + left)
    both, held = [training, other], [training, replace(other, held_out=True)]
    once, more = (validity_of(each, None).coefficients[:, 0] for each in (both, held))
    assert more == pytest.approx(4.0 * once, rel=0.15)


def test_where_a_joint_stands_its_friction_is_anything() -> None:
    made = trace(0.1)
    friction = 0.5 * made.v + 3.0 * np.sign(made.v)
    shift = {"measured": made.measured + friction, "predicted": made.predicted + friction}
    validity = validity_of([replace(made, **shift)], None)
    assert validity.line[:, 1] == pytest.approx([3.0, 3.0])
    assert said(validity, v=0.0) == pytest.approx(np.hypot(0.1, 3.0 / np.sqrt(3.0)), rel=0.05)
    assert said(validity, v=0.5, torque=3.25) == pytest.approx(0.1, rel=0.2)


def test_a_curve_is_uncertain_where_it_leaves_the_straight_line() -> None:
    made = trace(0.01)
    cube = 4.0 * made.v**3
    validity = validity_of(
        [replace(made, measured=made.measured + cube, predicted=made.predicted + cube)], None
    )
    line = float(validity.line[0, 0] * 2.0 + validity.line[0, 1])
    curve = 4.0 * 2.0**3 - line
    assert said(validity, v=2.0, torque=32.0)[0] == pytest.approx(np.sqrt(0.05) * curve, rel=0.05)


def test_of_a_joint_that_only_stood_nothing_is_known_of_its_motion() -> None:
    made = trace(0.2)
    made = replace(made, v=np.where([True, False], 0.0, made.v))
    assert deviation([made], 0.0, 5.0) == pytest.approx([0.2, 0.1], rel=0.1)
    assert np.isinf(deviation([made], 0.1, 5.0)).tolist() == [True, False]


def test_of_joints_without_samples_nothing_is_known() -> None:
    made = trace(0.2)
    made = replace(made, measured=np.where([False, True], made.measured, np.nan))
    assert np.isnan(deviation([made], 0.5, 5.0)).tolist() == [True, False]


def test_parameters_count_by_their_covariance(loop: Loop) -> None:
    model = Model.load(loop.fit)
    robot, own, fit = model.made.robot, model.made.model, read_fit(loop.fit).fit
    q, v, a = robot.draw_states(50, seed=3)
    series = Series(0.01 * np.arange(50), q, v, a)
    base = find_base_parameters(robot)
    signals = with_effects(signals_of(series, robot, own.phi), own.effects, own.values)
    regressor = RigidBody(robot, own.phi, q, v, a).regressor[:, :, base.selection]
    columns = np.concatenate([regressor, effect_columns(own.effects, signals)], axis=2)
    known = np.isfinite(np.diag(fit.covariance))
    assert known.all()
    expected = np.sqrt(np.einsum("tjp,pq,tjq->tj", columns, fit.covariance, columns))
    found = Trust(model.made).by_parameters(series)
    # The prior of the bodies narrows the covariance a little.
    assert np.all(found < 1.001 * expected)
    assert np.median(found / expected) > 0.9


def test_no_effect_is_unsure_by_more_than_all_torque_of_its_joint(loop: Loop) -> None:
    """Nothing is known of the size of its dry friction."""
    made = Model.load(loop.fit).made
    size = find_base_parameters(made.robot).rank
    bare = replace(made, model=made.model.without(made.model.effects), factor=1e6 * np.eye(size))
    rubbing = IdentifiedModel(made.model.phi, (kind_named("coulomb_friction")((0,)),), np.ones(1))
    factor = np.pad(1e6 * np.eye(size), ((0, 1), (0, 1)))
    q, v, a = made.robot.draw_states(50, seed=3)
    series = Series(0.01 * np.arange(50), q, v, a)
    found = Trust(replace(bare, model=rubbing, factor=factor)).by_parameters(series)
    assert Trust(bare).by_parameters(series).max() < 1e-3
    torque = np.sqrt(np.nanmean(np.concatenate([np.square(t.measured) for t in made.traces]), 0))
    assert found[:, 0].max() == pytest.approx(torque[0], rel=0.2)
    assert found[:, 1].max() < 1e-3


def test_models_say_it_beside_the_torque(loop: Loop) -> None:
    model = Model.load(loop.fit)
    q, v, a = model.made.robot.draw_states(7, seed=1)
    torque, std = model.torque(q, v, a, std=True)
    assert torque == pytest.approx(model.torque(q, v, a))
    assert std.shape == torque.shape
    assert (std > 0.0).all()
    one, its = model.torque(q[0], v[0], a[0], std=True)
    assert one.shape == its.shape == (2,)
    assert its == pytest.approx(std[0])


def test_without_a_residual_it_is_refused(loop: Loop) -> None:
    model = Model.load(loop.fit)
    bare = Model(replace(model.made, path=Path("a.yaml"), traces=()))
    with pytest.raises(ConfigError, match=r"a\.yaml does not say what it left of its own data\."):
        bare.torque(*np.zeros((3, 2)), std=True)
