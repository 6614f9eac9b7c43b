"""Doubts of the set-up that an effect would say as well are the diagnosis' to decide."""

from types import SimpleNamespace
from typing import Any

import pytest

from excite_cli.diagnosis.diagnose import _is_denied
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Finding

TILT, SPRING = (kind_named(name)((0, 1)) for name in ("base_tilt", "coupled_friction"))


@pytest.mark.parametrize(
    ("doubt", "tried", "found", "declared", "denied"),
    [
        ("mount", True, False, False, True),
        ("mount", True, True, False, False),
        ("mount", True, False, True, False),
        ("mount", False, False, False, False),  # it was not looked for: nobody knows
        ("torque_lag", True, False, False, False),
        ("order", True, False, False, False),  # no effect says that columns are exchanged
    ],
)
def test_a_base_that_leans(
    doubt: str, tried: bool, found: bool, declared: bool, denied: bool
) -> None:
    traced: Any = SimpleNamespace(
        candidates=[SimpleNamespace(effect=TILT if tried else SPRING)],
        effects=(TILT,) if found else (SPRING,),
        model=SimpleNamespace(declared=(TILT,) if declared else ()),
    )
    assert _is_denied(Finding(doubt, "warning", "it leans"), traced) is denied
