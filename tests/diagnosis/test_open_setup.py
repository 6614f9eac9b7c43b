"""While the set-up is in doubt, what not every robot has is not confirmed."""

from dataclasses import replace

import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, kind_named
from excite_cli.measurement.dataset import Dataset, Finding
from excite_cli.robot.model import build_robot
from tests.cli.program import SMOKE
from tests.diagnosis.test_held_out import RATE, friction, motion

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

KINDS = "[viscous_friction,coulomb_friction,load_dependent_friction]"
SPEC = load_spec(SMOKE, [f"diagnosis.kinds={KINDS}"])
ROBOT = build_robot(SPEC.robot, SMOKE.parent)


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    motions = [motion(ROBOT, number) for number in (1, 2, 3)]
    by_load = plant(kind_named("load_dependent_friction"), (1,), 0.15)
    settings = SimulationSettings(rate=RATE, lead_in=0.5)
    return simulate(ROBOT, motions, settings, [friction(), by_load]).dataset


def told(data: Dataset, spec: Spec = SPEC) -> Diagnosis:
    return diagnose(ROBOT, find_base_parameters(ROBOT), data, spec)


def confirmed(found: Diagnosis) -> set[str]:
    return {e.effect.kind for e in found.effects if e.verdict is HeldOutVerdict.CONFIRMED}


def test_what_is_confirmed_waits_for_the_setup(dataset: Dataset) -> None:
    assert "load_dependent_friction" in confirmed(told(dataset))
    clock = Finding("clock", "warning", "a second lasts 0.7 s", "", (), {"measurement.clock": 0.7})
    doubted = told(replace(dataset, findings=(clock,)))
    assert confirmed(doubted) <= {*EVERYDAY_FRICTION, *EVERYDAY}
    assert any(each.kind == "open_setup" for each in doubted.findings)


def test_speeds_that_nothing_needs_are_no_doubt(dataset: Dataset) -> None:
    gain = Finding("gain", "warning", "odd", "", (), {"measurement.channels": {"dq": None}})
    assert "load_dependent_friction" in confirmed(told(replace(dataset, findings=(gain,))))


@pytest.mark.parametrize("trust", ["[clock]", "true"])
def test_a_doubt_that_the_config_resolves_is_not_open(dataset: Dataset, trust: str) -> None:
    clock = Finding("clock", "warning", "a second lasts 0.7 s", "", (), {"measurement.clock": 0.7})
    words = [f"diagnosis.kinds={KINDS}", f"measurement.trust={trust}"]
    found = told(replace(dataset, findings=(clock,)), load_spec(SMOKE, words))
    assert "load_dependent_friction" in confirmed(found)
