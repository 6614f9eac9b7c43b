"""Friction that changes over a turn, in MuJoCo: named with its size, and its mean with its own.

Four short runs of the smoke arm, the last held out; no effect is declared.
"""

import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.test_changes import ELBOW, PITCH, motion

KINDS = (
    "viscous_friction,coulomb_friction,asymmetric_friction,load_dependent_friction,"
    "position_friction,stribeck_friction,spring,torque_offset"
)


MEANS = {0.0: "coulomb_friction", 1.0: "viscous_friction"}


def diagnosed(power: float) -> Diagnosis:
    """Friction of 3 + 2 cos 2q − 1.5 sin 2q on the elbow, and dry friction elsewhere."""
    spec: Spec = load_spec(SMOKE, [f"diagnosis.kinds=[{KINDS}]"])
    robot: Robot = build_robot(spec.robot, SMOKE.parent)
    motions = [motion(robot, number) for number in range(1, 5)]
    others = {"sin": -1.5, "periods": 2.0, "power": power}
    effects = [
        plant(kind_named("coulomb_friction"), (PITCH,), 5.0),
        plant(kind_named("position_friction"), (ELBOW,), 2.0, others),
        plant(kind_named(MEANS[power]), (ELBOW,), 3.0),
    ]
    data = simulate(robot, motions, SimulationSettings(rate=200.0, lead_in=0.5), effects).dataset
    return diagnose(robot, find_base_parameters(robot), data, spec)


@pytest.mark.parametrize("power", MEANS)
def test_it_is_named_beside_its_mean(power: float) -> None:
    found = {(e.effect.kind, *e.effect.joints): e for e in diagnosed(power).effects}
    elbow = found["position_friction", "elbow"]
    mean = MEANS[power], "elbow"
    assert set(found) == {
        ("position_friction", "elbow"),
        ("coulomb_friction", "shoulder_pitch"),
        mean,
    }
    assert elbow.effect.shape == {"periods": 2.0, "power": power}
    sizes = [elbow.parameters[name] for name in ("cos", "sin")]
    assert [size.value for size in sizes] == pytest.approx([2.0, -1.5], abs=0.1)
    assert {size.unit for size in sizes} == {"N·m·s/rad" if power else "N·m"}
    (there,) = found[mean].parameters.values()
    assert there.value == pytest.approx(3.0, abs=0.1)
