"""Friction that builds up over a distance, in MuJoCo: named, with its size and its distance.

Four short runs of the smoke arm, the last held out; dry friction alone is declared.
"""

from collections.abc import Sequence

import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects, kind_named
from excite_cli.robot.model import Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from benchmarks.battery.outside import DahlBySpeed, MaxwellSlip
from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.test_changes import ELBOW, PITCH, motion

ELSE = "stribeck_friction,nonlinear_viscous_friction,elasticity,backlash,torque_delay,ripple,spring"
FRICTION = "viscous_friction,coulomb_friction,load_dependent_friction,dahl_friction"


def diagnosed(*effects: Planted) -> Diagnosis:
    spec: Spec = load_spec(
        SMOKE,
        [f"diagnosis.kinds=[{FRICTION},{ELSE}]", "effects=[{kind: coulomb_friction, joints: all}]"],
    )
    robot: Robot = build_robot(spec.robot, SMOKE.parent)
    motions = [motion(robot, number) for number in range(1, 5)]
    declared: Sequence[Effect] = declared_effects(spec.effects, robot)
    settings = SimulationSettings(rate=200.0, lead_in=0.5)
    data = simulate(robot, motions, settings, effects, declared).dataset
    return diagnose(robot, find_base_parameters(robot), data, spec)


def rubbing(kind: type[Effect], joint: int, size: float, distance: float) -> list[Planted]:
    """Dry friction, all of which has a memory, beside that which is declared."""
    dry = kind_named("coulomb_friction")
    return [plant(dry, (joint,), size), plant(kind, (joint,), size, {"distance": distance})]


def names(found: Diagnosis) -> list[tuple[str, str]]:
    return [(e.effect.kind, e.effect.joints[0]) for e in found.effects if e.approximates is None]


def test_dahl_friction_is_named_with_its_size_and_distance() -> None:
    """Integrated over time in the robot, not over the way as in the columns."""
    found = diagnosed(
        *rubbing(DahlBySpeed, ELBOW, 4.0, 0.05),
        *rubbing(DahlBySpeed, PITCH, 8.0, 0.02),
    )
    assert sorted(names(found)) == [("dahl_friction", "elbow"), ("dahl_friction", "shoulder_pitch")]
    for each in found.effects:
        size, distance = (4.0, 0.05) if each.effect.joints == ("elbow",) else (8.0, 0.02)
        friction = each.parameters["friction"]
        assert friction.value == pytest.approx(size, abs=2.5 * friction.std)
        assert each.effect.shape["distance"] == pytest.approx(distance, rel=0.05)
    assert not found.unexplained
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving


def test_another_form_of_memory_gets_no_other_name() -> None:
    found = diagnosed(*rubbing(MaxwellSlip, ELBOW, 5.0, 0.04))
    assert set(names(found)) <= {("dahl_friction", "elbow")}
    told = {e.effect.joints[0] for e in found.effects} | {u.joint for u in found.unexplained}
    assert told == {"elbow"}
