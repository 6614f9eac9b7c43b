"""With nothing searched, `diagnose` and `identify` are one regression, on logs of real robots."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli import diagnose, identify, load_case, load_data

pytestmark = pytest.mark.long

DATA = Path(__file__).resolve().parents[2] / "data"
KINDS = ("viscous_friction", "coulomb_friction", "torque_offset")


@pytest.mark.parametrize("inertias", ["auto", "free", "cad"])
@pytest.mark.parametrize("log", ["kr300/kr300", "med7/med7"])
def test_parameters_and_deviations_are_the_same(log: str, inertias: str) -> None:
    effects = ", ".join(f"{{kind: {kind}, joints: all}}" for kind in KINDS)
    keys = [f"effects=[{effects}]", f"identification.inertias={inertias}", "diagnosis.rounds=0"]
    case = load_case(DATA / f"{log}.yaml", keys)
    data = load_data(case, DATA / f"{log}.h5")
    one, other = identify(case, data), diagnose(case, data)
    rank = len(other.base_values)
    assert other.base_values == pytest.approx(one.fit.base_values, rel=1e-9, abs=1e-9)
    assert other.base_std == pytest.approx(one.fit.std[:rank], rel=1e-9)
    told = np.concatenate([each.values for each in other.declared])
    assert told == pytest.approx(one.fit.values[rank:], rel=1e-9, abs=1e-9)
    assert other.after.mean_relative == pytest.approx(one.error.mean_relative, rel=1e-9)
