"""Every kind of effect shows in the recorded torque as physics says, seen from outside.

References are formulas written here or Pinocchio's inverse dynamics, not the effects' own columns.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Parameter, Signals
from excite_cli.effects.catalogue import catalogue
from excite_cli.errors import RobotError
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import assemble
from excite_cli.simulation.ground_truth import PlantedEffect, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.simulate import Simulation, simulate
from tests.simulation.arms import (
    ELBOW,
    IDEAL,
    beyond_rigid,
    inner,
    motion,
    planted,
    played,
    rms,
    slipping,
    states,
)

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def clean(robot: Robot) -> Simulation:
    return played(robot)


def others_untouched(left: Array, joints: tuple[int, ...] = (ELBOW,)) -> None:
    rest = [j for j in range(left.shape[1]) if j not in joints]
    assert rms(left[:, rest]).max() < 0.05  # of up to 80 N·m


def moving(simulation: Simulation) -> tuple[Array, Array, Array, Array]:
    """Samples at which the elbow moves, and its q, v, a there."""
    run = simulation.dataset.runs[0]
    keep = slipping(run, ELBOW)
    assert keep.mean() > 0.5
    q, v, a = (inner(x)[keep, ELBOW] for x in states(run))
    return keep, q, v, a


def peak(x: Array) -> float:
    return float(np.abs(x).max())


def lossy(driving: float, back_driving: float, v: Array, load: Array) -> Array:
    return np.where(load * v > 0, driving, back_driving) * np.abs(load) * np.sign(v)


# An effect on the elbow, what it is from q, v, a and the rigid load there, and how exactly.
FORMULAS: list[tuple[str, float, dict[str, float], Callable[..., Array], Callable, float]] = [
    ("coulomb_friction", 4.0, {}, lambda q, v, a, load: 4.0 * np.sign(v), peak, 0.08),
    ("viscous_friction", 5.0, {}, lambda q, v, a, load: 5.0 * v, peak, 0.03),
    ("armature", 2.0, {}, lambda q, v, a, load: 2.0 * a, peak, 0.03),
    ("spring", 20.0, {"rest_position": 0.5}, lambda q, v, a, load: 20 * (q - 0.5), peak, 0.03),
    # One that pushes away has no part in MuJoCo, but acts.
    ("spring", -15.0, {}, lambda q, v, a, load: -15.0 * q, peak, 0.05),
    (
        *("asymmetric_friction", 5.0, {"backward": 2.0}),
        *(lambda q, v, a, load: np.where(v > 0, 5.0, -2.0), peak, 0.1),
    ),
    (
        *("stribeck_friction", 3.0, {"stribeck_speed": 0.2}),
        *(lambda q, v, a, load: 3.0 * np.exp(-((v / 0.2) ** 2)) * np.sign(v), rms, 0.05),
    ),
    (
        *("stribeck_friction", 0.1, {"stribeck_speed": 0.2, "load_power": 1.0}),
        *(
            lambda q, v, a, load: 0.1 * np.exp(-((v / 0.2) ** 2)) * abs(load) * np.sign(v),
            rms,
            0.05,
        ),
    ),
    (
        *("load_dependent_friction", 0.1, {}),
        *(lambda q, v, a, load: 0.1 * np.abs(load) * np.sign(v), rms, 0.05),
    ),
    (
        *("gear_loss", 0.15, {"back_driving": 0.05}),
        *(lambda q, v, a, load: lossy(0.15, 0.05, v, load), rms, 0.05),
    ),
    (
        *("nonlinear_viscous_friction", 8.0, {"power": 2.0}),
        *(lambda q, v, a, load: 8.0 * v * np.abs(v), rms, 0.03),
    ),
    (
        *("ripple", 1.0, {"sin": 0.5, "periods": 40.0}),
        *(lambda q, v, a, load: np.cos(40 * q) + 0.5 * np.sin(40 * q), rms, 0.03),
    ),
]


@pytest.mark.long
@pytest.mark.parametrize(("kind", "value", "others", "formula", "size", "most"), FORMULAS)
def test_effects_of_one_joint_are_their_formulas(
    robot: Robot,
    kind: str,
    value: float,
    others: dict[str, float],
    formula: Callable[..., Array],
    size: Callable[[Array], float],
    most: float,
) -> None:
    simulation = played(robot, planted(kind, (ELBOW,), value, **others))
    left = beyond_rigid(robot, simulation)
    keep, q, v, a = moving(simulation)
    run = simulation.dataset.runs[0]
    load = inner(RigidBody(robot, simulation.truth.phi, *states(run)).load)[keep, ELBOW]
    assert size(left[keep, ELBOW] - formula(q, v, a, load)) < most
    others_untouched(left)


def test_dahl_friction_builds_up_over_its_distance(robot: Robot) -> None:
    """All of the dry friction: 1 − 2 exp(−way/distance) after each reversal from sliding."""
    dry = planted("coulomb_friction", (ELBOW,), 4.0)
    simulation = played(robot, dry, planted("dahl_friction", (ELBOW,), 4.0, distance=0.04))
    left = beyond_rigid(robot, simulation)[:, ELBOW]
    q, v, _ = (inner(x)[:, ELBOW] for x in states(simulation.dataset.runs[0]))
    turns = np.flatnonzero(np.diff(np.sign(v)))
    assert len(turns) > 3
    checked = 0
    for before, turn, after in zip([0, *turns], turns, [*turns[1:], len(v)], strict=False):
        if abs(q[turn] - q[before]) < 0.2:  # of what was before, more than 1 % is left
            continue
        way = np.abs(q[turn + 10 : after] - q[turn])
        expected = 4.0 * np.sign(v[turn + 1]) * (1.0 - 2.0 * np.exp(-way / 0.04))
        assert left[turn + 10 : after] == pytest.approx(expected, abs=0.15)
        checked += 1
    assert checked >= 2
    others_untouched(beyond_rigid(robot, simulation))
    with pytest.raises(RobotError, match=r"lacks 1 N·m of dry .* 'coulomb_friction@elbow_joint=…'"):
        played(robot, dry, planted("dahl_friction", (ELBOW,), 5.0))


def test_friction_that_drifts_down_is_less_at_the_end(robot: Robot) -> None:
    effects = (
        planted("coulomb_friction", (ELBOW,), 5.0),
        planted("friction_drift", (ELBOW,), -0.5),
    )
    simulation = played(robot, *effects)
    left = beyond_rigid(robot, simulation)
    keep, _, v, _ = moving(simulation)
    t = inner(simulation.dataset.runs[0].t)[keep]
    assert rms(left[keep, ELBOW] - (5.0 - 0.5 * t) * np.sign(v)) < 0.1


def test_a_cable_pulls_on_both_joints_with_one_potential(robot: Robot) -> None:
    simulation = played(robot, planted("cable_force", (ELBOW, ELBOW + 1), 3.0))
    left = beyond_rigid(robot, simulation)
    q = inner(simulation.dataset.runs[0].q)
    assert rms(left[:, ELBOW] - 3.0 * q[:, ELBOW + 1]) < 0.01
    assert rms(left[:, ELBOW + 1] - 3.0 * q[:, ELBOW]) < 0.01
    others_untouched(left, (ELBOW, ELBOW + 1))


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_coupled_friction_is_on_the_common_shaft(robot: Robot, direction: float) -> None:
    first, second = 1, ELBOW
    effect = planted("coupled_friction", (first, second), 2.0, coulomb=3.0, direction=direction)
    simulation = played(robot, effect)
    left = beyond_rigid(robot, simulation)
    v = inner(states(simulation.dataset.runs[0])[1])
    shaft = v[:, first] + direction * v[:, second]
    keep = np.abs(shaft) > 0.05
    assert keep.mean() > 0.5
    dry = 3.0 * np.sign(shaft)
    assert rms((left[:, first] - 2.0 * direction * v[:, second] - dry)[keep]) < 0.1
    assert rms((left[:, second] - 2.0 * direction * v[:, first] - direction * dry)[keep]) < 0.1


def test_a_tilted_base_turns_gravity(robot: Robot) -> None:
    """Against the inverse dynamics of the same robot with its base turned by roll and pitch."""
    simulation = played(robot, planted("base_tilt", tuple(range(6)), 0.05, pitch=0.02))
    run = simulation.dataset.runs[0]
    tilted = robot.model.copy()
    roll, pitch = 0.05, 0.02
    # What a plumb line does in the frame of a base turned about x, then y (to second order).
    tilted.gravity.linear = -9.81 * np.array([-pitch, roll, 1 - (roll**2 + pitch**2) / 2])
    turned = RigidBody(replace(robot, model=tilted), simulation.truth.phi, *states(run))
    assert rms(inner(run.tau - turned.load)).max() < 0.02
    assert rms(beyond_rigid(robot, simulation))[0] > 1.0


def test_a_payload_is_there_in_its_run_only(robot: Robot) -> None:
    kind = catalogue()["payload"]
    payload = plant(kind, tuple(range(6)), 2.0, {"cz": 0.1}, ("motion_2",))
    motions = [motion(robot, 0, "motion_1"), motion(robot, 1, "motion_2")]
    simulation = simulate(robot, motions, IDEAL, [payload])
    assert rms(beyond_rigid(robot, simulation, 0)).max() < 0.05
    run = simulation.dataset.runs[1]
    loaded = simulation.truth.phi.copy()
    loaded[-10] += 2.0  # mass and first moment by hand; a small sphere's inertia stays
    loaded[-7] += 0.2
    body = RigidBody(robot, loaded, *states(run))
    assert rms(beyond_rigid(robot, simulation, 1))[1] > 5.0
    assert rms(inner(run.tau - body.load)).max() < 0.5


def test_an_encoder_reads_less_than_the_truth(robot: Robot, clean: Simulation) -> None:
    simulation = played(robot, planted("encoder_offset", (ELBOW,), 0.02))
    read, true = simulation.dataset.runs[0], clean.dataset.runs[0]
    apart = true.q - read.q
    assert apart[:, ELBOW] == pytest.approx(0.02, abs=1e-9)
    assert np.array_equal(true.tau, read.tau)


@pytest.mark.parametrize("last", [ELBOW, 5])
def test_a_contact_pushes_the_frame_of_its_last_joint_during_its_window(
    robot: Robot, last: int
) -> None:
    effect = planted("contact", tuple(range(last + 1)), 20.0, fz=-10.0, start=1.0, end=2.0)
    simulation = played(robot, effect)
    run = simulation.dataset.runs[0]
    left = beyond_rigid(robot, simulation)
    t = inner(run.t)
    body = RigidBody(robot, simulation.truth.phi, *states(run))
    pushes = -body.frame_jacobian(last)[:, :3].transpose(0, 2, 1)
    pushed = inner(pushes @ np.array([20.0, 0.0, -10.0]))
    settled = (t > 1.1) & (t < 1.98)
    outside = (t < 0.98) | (t > 2.2)
    assert rms(pushed[settled]).max() > 5.0
    assert rms((left - pushed)[settled]).max() < 0.05
    assert rms(left[outside]).max() < 0.05


def test_an_elastic_gear_turns_by_what_it_carries(robot: Robot) -> None:
    """At rest: the torque is gravity's at the link, compliance · torque behind the motor."""
    compliance = 2e-3
    trajectory = motion(robot).trajectory
    posture = np.array([0.3, -1.0, 2.2, -0.5, 0.7, 0.2])
    still = PlannedMotion("motion_1", trajectory, trajectory.constant(posture))
    effect = planted("elasticity", (ELBOW,), compliance, damping_ratio=0.5)
    simulation = simulate(robot, [still], replace(IDEAL, lead_in=3.0), [effect])
    run = simulation.dataset.runs[0]
    motor, tau = run.q[-1:], run.tau[-1]
    link, rest = motor.copy(), np.zeros_like(motor)
    link[0, ELBOW] -= compliance * tau[ELBOW]
    at_motor, at_link = (
        RigidBody(robot, simulation.truth.phi, q, rest, rest).load[0] for q in (motor, link)
    )
    assert tau == pytest.approx(at_link, abs=1e-3)
    assert np.abs(tau - at_motor).max() > 0.3


def test_an_elastic_gear_swings_at_its_own_frequency(robot: Robot) -> None:
    """After a push, with motors that hardly hold: two inertias on a spring."""
    compliance, rotor = 1e-4, 4.0
    trajectory = motion(robot).trajectory
    posture = np.array([0.3, -1.0, 1.0, -0.5, 0.7, 0.2])
    still = PlannedMotion("motion_1", trajectory, trajectory.constant(posture))
    gear = planted("elasticity", (ELBOW,), compliance, rotor_inertia=rotor, damping_ratio=0.002)
    push = planted("contact", tuple(range(6)), 0.0, fz=-30.0, start=0.5, end=0.6)
    settings = replace(IDEAL, bandwidth=1.0, inertia_error=0.0)
    simulation = simulate(robot, [still], settings, [gear, push])
    run = simulation.dataset.runs[0]
    body = RigidBody(robot, simulation.truth.phi, posture[None], *np.zeros((2, 1, robot.n)))
    # Nearly free motors: all other joints give way, so the link moves 1/(M⁻¹) of the elbow.
    inverse = np.linalg.inv(body.mass[0])[ELBOW, ELBOW]
    expected = np.sqrt((1.0 / rotor + inverse) / compliance) / (2 * np.pi)
    q = run.q[run.t > 0.7, ELBOW]
    swing = np.diff(q, 2) * np.hanning(len(q) - 2)
    frequencies = np.fft.rfftfreq(16 * len(q), 1 / 500.0)
    height = np.abs(np.fft.rfft(swing, 16 * len(q))) * (frequencies > 5.0)
    found = frequencies[int(np.argmax(height))]
    assert found == pytest.approx(expected, rel=0.03)


def test_play_lets_the_link_hang_on_one_flank(robot: Robot) -> None:
    gap = 0.02
    simulation = played(robot, planted("backlash", (ELBOW,), gap))
    run = simulation.dataset.runs[0]
    q, v, a = states(run)
    load = RigidBody(robot, simulation.truth.phi, q, v, a).load[:, ELBOW]
    assert (load < -1.0).all()  # so the link stands half the gap above the motor
    at_link = q.copy()
    at_link[:, ELBOW] += gap / 2
    low = butter(3, 8.0, fs=500.0, output="sos")
    before, after = (
        rms(sosfiltfilt(low, run.tau - body.load, axis=0)[200:-200])
        for body in (
            RigidBody(robot, simulation.truth.phi, angles, v, a) for angles in (q, at_link)
        )
    )
    assert before[1] > 0.03
    assert after[1] < 0.3 * before[1]


def test_recorded_torque_is_shifted_scaled_and_late(robot: Robot, clean: Simulation) -> None:
    true = clean.dataset.runs[0]
    joint = (ELBOW,)
    moved = played(robot, planted("torque_offset", joint, 1.5)).dataset.runs[0].tau
    assert moved[:, ELBOW] - true.tau[:, ELBOW] == pytest.approx(1.5)
    scaled = played(robot, planted("torque_gain", joint, 0.1)).dataset.runs[0].tau
    assert scaled[:, ELBOW] == pytest.approx(1.1 * true.tau[:, ELBOW])
    assert np.array_equal(scaled[:, 0], true.tau[:, 0])
    leaks = played(robot, planted("torque_crosstalk", (ELBOW, 1), 0.1)).dataset.runs[0].tau
    assert leaks[:, ELBOW] == pytest.approx(true.tau[:, ELBOW] + 0.1 * true.tau[:, 1])
    assert np.array_equal(np.delete(leaks, ELBOW, 1), np.delete(true.tau, ELBOW, 1))
    late = played(robot, planted("torque_delay", tuple(range(6)), 0.02)).dataset.runs[0].tau
    lags = np.arange(-30, 31)
    for j in range(3):
        matches = [
            -rms(late[50:-50, j] - true.tau[50 - lag : len(late) - 50 - lag, j]) for lag in lags
        ]
        assert lags[int(np.argmax(matches))] == 10  # samples at 500 Hz


def test_readings_saturate_and_so_may_motors(robot: Robot, clean: Simulation) -> None:
    true = clean.dataset.runs[0]
    level = float(np.quantile(np.abs(true.tau[:, ELBOW]), 0.8))
    read = played(robot, planted("torque_saturation", (ELBOW,), level))
    assert read.dataset.runs[0].tau[:, ELBOW] == pytest.approx(
        np.clip(true.tau[:, ELBOW], -level, level)
    )
    assert np.array_equal(read.dataset.runs[0].q, true.q)
    weak = played(robot, planted("torque_saturation", (ELBOW,), level, actuator=1.0))
    assert np.abs(weak.dataset.runs[0].tau[:, ELBOW]).max() <= level + 1e-9
    assert weak.tracking["motion_1"][ELBOW] > 5 * clean.tracking["motion_1"][ELBOW]


@dataclass(frozen=True)
class MagneticDetent(Effect):
    """An effect that no catalogue has: τ_j = c sin(8 q_j) cos(2 v_j)."""

    kind: ClassVar = "magnetic_detent"
    title: ClassVar = "detent"
    signature: ClassVar = "none"
    parameters: ClassVar = (Parameter("size", "N·m", 0.1, 10.0),)

    def columns(self, signals: Signals) -> Array:
        q, v = signals.q[:, list(self.joints), None], signals.v[:, list(self.joints), None]
        return np.sin(8 * q) * np.cos(2 * v)


@dataclass(frozen=True)
class SlowDrift(MagneticDetent):
    """A defect of the data that no catalogue has: τ_j grows with time."""

    kind: ClassVar = "slow_drift"
    data_defect: ClassVar = True
    shape: Mapping[str, float] = field(default_factory=dict)

    def columns(self, signals: Signals) -> Array:
        return np.array(signals.t)[:, None, None]


def test_effects_of_others_act_through_their_own_formula(robot: Robot, clean: Simulation) -> None:
    simulation = played(robot, PlantedEffect(MagneticDetent((ELBOW,)), np.array([2.0])))
    left = beyond_rigid(robot, simulation)
    q, v, _ = (inner(x)[:, ELBOW] for x in states(simulation.dataset.runs[0]))
    assert rms(left[:, ELBOW] - 2.0 * np.sin(8 * q) * np.cos(2 * v)) < 0.03
    drifting = played(robot, PlantedEffect(SlowDrift((ELBOW,)), np.array([0.3]))).dataset.runs[0]
    grown = drifting.tau[:, ELBOW] - clean.dataset.runs[0].tau[:, ELBOW]
    assert grown == pytest.approx(0.3 * drifting.t, abs=1e-9)


# What of the simulated robot each kind changes; all others act through their own formula, which the
# controller knows.
CHANGED = {
    "wrench_gain": {"gain"},
    "torque_gain": {"gain"},
    "elasticity": {"soft"},
    "backlash": {"soft"},
    "viscous_friction": {"damping", "compensated"},
    "coulomb_friction": {"friction", "compensated"},
    "armature": {"armature", "compensated"},
    "spring": {"springs", "compensated"},
    "dahl_friction": {"hystereses", "friction", "compensated"},
    "coupled_friction": {"couplings", "looped", "compensated"},
    "base_tilt": {"gravity"},
    "payload": {"phi"},
    "encoder_offset": {"position_offset"},
    "contact": {"pushes"},
    "torque_offset": {"offset"},
    "covariate_offset": {"recorded"},
    "torque_crosstalk": {"recorded"},
    "torque_delay": {"delay"},
    "torque_saturation": {"reading"},
}


def a_place(kind: type[Effect], robot: Robot) -> tuple[int, ...]:
    whole = kind.scope in ("robot", "base")
    return tuple(range(robot.n)) if whole else kind.places(robot)[0]


def test_every_kind_of_the_catalogue_can_be_planted(robot: Robot, clean: Simulation) -> None:
    """With its defaults: it runs, and something recorded differs from the bare robot.

    What comes over a campaign is nothing in its first recording, what follows a column of the log
    nothing without one.
    """
    apart = ("friction_drift", "cable_force")  # with tests of their own, as those of formulas
    tested = {*CHANGED, *apart, *(row[0] for row in FORMULAS)} - {"wrench_gain"}
    for name in sorted(set(catalogue()) - tested):
        kind = catalogue()[name]
        if kind.of_campaign or kind.follows_covariate:
            continue
        joints = a_place(kind, robot)
        run = played(robot, plant(kind, joints, kind.parameters[0].high / 10)).dataset.runs[0]
        assert not np.array_equal(run.tau, clean.dataset.runs[0].tau), name


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_kind_goes_into_the_robot_by_its_own_part(robot: Robot, name: str) -> None:
    kind = catalogue()[name]
    joints = a_place(kind, robot)
    others = {"coulomb": 2.0} if name == "coupled_friction" else {}
    phi = standard_parameters(robot)
    bare, built = (
        vars(assemble(robot, phi, "run", effects))
        for effects in ((), (plant(kind, joints, 0.5, others),))
    )
    changed = {part for part in bare if not np.array_equal(bare[part], built[part])}
    assert changed == CHANGED.get(name, {"looped", "compensated"})
