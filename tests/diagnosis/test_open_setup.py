"""While the set-up is in doubt, what not every robot has is not confirmed."""

from dataclasses import replace
from typing import Any

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.measurement.dataset import Finding
from tests.diagnosis.simulated_arm import ELBOW, PITCH, planted, played, told


def confirmed(found: Diagnosis) -> set[str]:
    return {e.effect.kind for e in found.effects if e.verdict is HeldOutVerdict.CONFIRMED}


def test_what_is_confirmed_waits_for_the_setup() -> None:
    """Not where the config resolves the doubt, nor for speeds that nothing needs."""
    by_load = planted("load_dependent_friction", PITCH, 0.15)
    data = played([planted("coulomb_friction", ELBOW, 1.5), by_load])

    def doubted(change: dict[str, Any], *keys: str) -> Diagnosis:
        doubt = Finding("clock", "warning", "a second lasts 0.7 s", "", (), change)
        kinds = "viscous_friction,coulomb_friction,load_dependent_friction"
        return told(replace(data, findings=(doubt,)), kinds, *keys)

    clock = {"measurement.clock": 0.7}
    still_open = doubted(clock)
    assert confirmed(still_open) <= {*EVERYDAY_FRICTION, *EVERYDAY}
    assert any(each.kind == "open_setup" for each in still_open.findings)
    for trust in ("[clock]", "true"):
        resolved = doubted(clock, f"measurement.trust={trust}")
        assert "load_dependent_friction" in confirmed(resolved), trust
    speeds = doubted({"measurement.channels": {"dq": None}})
    assert "load_dependent_friction" in confirmed(speeds)
