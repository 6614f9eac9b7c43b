"""Effects of a shape, and what only looks like one, in MuJoCo: named with sizes and shapes.

Four short runs of the smoke arm, the last held out.
"""

import numpy as np
import pytest

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from tests.diagnosis.simulated_arm import ELBOW, PITCH, PlantedEffect, plant, planted, played, told
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

pytest.importorskip("mujoco")

from benchmarks.battery.outside import DahlBySpeed, HardeningSpring, MaxwellSlip

pytestmark = pytest.mark.long

MEANS = {0.0: "coulomb_friction", 1.0: "viscous_friction"}


def diagnosed(*effects: PlantedEffect) -> Diagnosis:
    """Dry friction of all joints is declared."""
    kinds = (
        "viscous_friction,coulomb_friction,load_dependent_friction,dahl_friction,"
        "stribeck_friction,nonlinear_viscous_friction,elasticity,backlash,torque_delay,ripple,spring"
    )
    declared = "[{kind: coulomb_friction, joints: all}]"
    data = played(effects, (1, 2, 3, 4), 4.0, declared=declared)
    return told(data, kinds, f"effects={declared}")


def rubbing(kind: type[Effect], joint: int, size: float, distance: float) -> list[PlantedEffect]:
    """Dry friction, all of which has a memory, beside that which is declared."""
    dry = planted("coulomb_friction", joint, size)
    return [dry, plant(kind, (joint,), size, {"distance": distance})]


def names(found: Diagnosis) -> list[tuple[str, str]]:
    return [(e.effect.kind, e.effect.joints[0]) for e in found.effects if e.approximates is None]


def test_dahl_friction_is_named_with_its_size_and_distance() -> None:
    """Integrated over time in the robot, not over the way as in the columns."""
    on_elbow, on_pitch = (4.0, 0.05), (8.0, 0.02)
    found = diagnosed(
        *rubbing(DahlBySpeed, ELBOW, *on_elbow), *rubbing(DahlBySpeed, PITCH, *on_pitch)
    )
    assert sorted(names(found)) == [("dahl_friction", "elbow"), ("dahl_friction", "shoulder_pitch")]
    for each in found.effects:
        size, distance = on_elbow if each.effect.joints == ("elbow",) else on_pitch
        friction = each.parameters["friction"]
        assert friction.value == pytest.approx(size, abs=2.5 * friction.std)
        assert each.effect.shape["distance"] == pytest.approx(distance, rel=0.05)
    assert not found.unexplained
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving


def test_a_damped_bristle_is_found_with_its_damping() -> None:
    """LuGre's friction; without the damping Dahl's leaves several times as much."""
    dry = planted("coulomb_friction", ELBOW, 5.0)
    found = diagnosed(dry, planted("dahl_friction", ELBOW, 5.0, distance=0.02, damping=1.5))
    assert names(found) == [("dahl_friction", "elbow")]
    (named,) = found.effects
    assert named.effect.shape["distance"] == pytest.approx(0.02, rel=0.1)
    assert named.effect.shape["damping"] == pytest.approx(1.5, rel=0.1)
    friction = named.parameters["friction"]
    assert friction.value == pytest.approx(5.0, abs=0.3)


def test_part_of_another_joints_torque_is_named_with_its_share() -> None:
    """Of the second joint's whole torque, friction included, in the elbow's and not the reverse."""
    rubs = planted("coulomb_friction", PITCH, 6.0)
    leaks = planted("torque_crosstalk", (ELBOW, PITCH), 0.06)
    data = played((rubs, leaks), (1, 2, 3, 4), 4.0)
    found = {e.effect.kind: e for e in told(data, "all").effects}
    assert set(found) == {"coulomb_friction", "torque_crosstalk"}
    named = found["torque_crosstalk"]
    assert named.effect.joints == ("elbow", "shoulder_pitch")
    assert named.parameters["share"].value == pytest.approx(0.06, abs=0.002)


GEAR = (
    "viscous_friction,coulomb_friction,load_dependent_friction,gear_loss,torque_gain,torque_offset,"
    "stribeck_friction,position_friction,dahl_friction,spring"
)


def on_pitch(*effects: PlantedEffect) -> dict[str, dict[str, float]]:
    """Parameters of what is named, by its kind; all of it on the second joint."""
    declared = "[{kind: viscous_friction, joints: all}, {kind: coulomb_friction, joints: all}]"
    data = played(effects, (1, 2, 3, 4), 4.0, declared=declared)
    found = told(data, GEAR, f"effects={declared}").effects
    assert {each.effect.joints for each in found} == {("shoulder_pitch",)}
    return {
        each.effect.kind: {name: value.value for name, value in each.parameters.items()}
        for each in found
    }


def test_a_gear_that_loses_more_where_it_drives_is_told_by_both_losses() -> None:
    found = on_pitch(planted("gear_loss", PITCH, 0.15, back_driving=0.05))
    assert found == {"gear_loss": pytest.approx({"driving": 0.15, "back_driving": 0.05}, abs=0.01)}


def test_a_gear_that_loses_the_same_both_ways_has_the_simpler_name() -> None:
    found = on_pitch(planted("gear_loss", PITCH, 0.1, back_driving=0.1))
    assert found == {"load_dependent_friction": {"ratio": pytest.approx(0.1, abs=0.01)}}


def test_no_gear_gives_energy_so_that_a_larger_gain_is_one() -> None:
    rubs, gain = planted("load_dependent_friction", PITCH, 0.05), planted("torque_gain", PITCH, 0.1)
    assert on_pitch(rubs, gain) == {
        "load_dependent_friction": {"ratio": pytest.approx(0.05, abs=0.01)},
        "torque_gain": {"gain": pytest.approx(0.1, abs=0.01)},
    }


def test_another_form_of_memory_gets_no_other_name() -> None:
    found = diagnosed(*rubbing(MaxwellSlip, ELBOW, 5.0, 0.04))
    assert set(names(found)) <= {("dahl_friction", "elbow")}
    on = {e.effect.joints[0] for e in found.effects} | {u.joint for u in found.unexplained}
    assert on == {"elbow"}


@pytest.mark.parametrize("power", MEANS)
def test_friction_that_changes_over_a_turn_is_named_beside_its_mean(power: float) -> None:
    """Friction of 3 + 2 cos 2q − 1.5 sin 2q on the elbow, and dry friction elsewhere."""
    effects = [
        planted("coulomb_friction", PITCH, 5.0),
        planted("position_friction", ELBOW, 2.0, sin=-1.5, periods=2.0, power=power),
        planted(MEANS[power], ELBOW, 3.0),
    ]
    kinds = (
        "viscous_friction,coulomb_friction,asymmetric_friction,load_dependent_friction,"
        "position_friction,stribeck_friction,spring,torque_offset"
    )
    named = told(played(effects, (1, 2, 3, 4), 4.0), kinds).effects
    found = {(e.effect.kind, *e.effect.joints): e for e in named}
    elbow, mean = found["position_friction", "elbow"], (MEANS[power], "elbow")
    dry = ("coulomb_friction", "shoulder_pitch")
    assert set(found) == {("position_friction", "elbow"), dry, mean}
    assert elbow.effect.shape == {"periods": 2.0, "power": power}
    sizes = [elbow.parameters[name] for name in ("cos", "sin")]
    assert [size.value for size in sizes] == pytest.approx([2.0, -1.5], abs=0.1)
    assert {size.unit for size in sizes} == {"N·m·s/rad" if power else "N·m"}
    (there,) = found[mean].parameters.values()
    assert there.value == pytest.approx(3.0, abs=0.1)


def test_a_ripple_is_named_with_its_size_and_a_spring_that_hardens_is_none() -> None:
    periods = 2 * np.pi * 1.2 / 1.5  # the elbow travels about 1.5 rad in these runs
    found = diagnosed(planted("ripple", ELBOW, 2.0, periods=periods, phase=0.7))
    assert names(found) == [("ripple", "elbow")]
    (ripple,) = found.effects
    assert ripple.effect.shape["periods"] == pytest.approx(periods, rel=0.02)
    assert ripple.parameters["amplitude"].value == pytest.approx(2.0, rel=0.05)
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving
    # A spring that hardens is no ripple.
    found = diagnosed(plant(HardeningSpring, (ELBOW,), 6.0, {"rest": 0.3}))
    assert not names(found)
    assert found.effects or found.unexplained
    for each in found.effects:
        assert each.approximates is not None
        (of,) = each.approximates.covariates
        assert (of.quantity, of.joint) == ("position", "elbow")


def test_only_slow_ripples_must_beat_a_curve() -> None:
    """Fourth powers of the angle; five periods over the range are no such curve."""
    signals = signals_of(random_robot(4, joints=3, branches=False, prismatic=False))
    x, ripple = signals.q[:, 0], kind_named("ripple")

    def curve(periods: float) -> np.ndarray | None:
        shape = {"periods": 2 * np.pi * periods / float(np.ptp(x))}
        return ripple((0,), shape).curve(signals, [signals])

    slow = curve(1.2)
    assert slow is not None
    powers = np.stack([x**k for k in range(5)], axis=-1)
    rest = slow[:, 0] - powers @ np.linalg.lstsq(powers, slow[:, 0], rcond=None)[0]
    assert np.abs(rest).max() < 1e-6
    assert curve(5.0) is None
