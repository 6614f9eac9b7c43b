"""What is assumed of the sealed run, of effects that only some runs have."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.single_runs import assumptions
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Part

JOINTS = ("a", "b")


def run(name: str, block: int = 0) -> Run:
    t = np.arange(10) / 10.0
    return Run(name, t, np.zeros((10, 2)), np.zeros((10, 2)), part=Part(block=block))


def model(**states: Any) -> Any:
    return SimpleNamespace(robot=SimpleNamespace(joint_names=JOINTS), states=states)


@pytest.mark.parametrize(
    ("sealed", "declared", "told"),
    [
        (run("other"), {}, True),
        (run("only", block=3), {}, False),  # a block of the recording that has it
        (run("other"), {"other": {"contact": "none"}}, False),
    ],
)
def test_of_a_sealed_run_that_is_not_among_its_runs_an_effect_is_taken_to_be_absent(
    sealed: Run, declared: dict[str, Any], told: bool
) -> None:
    effect = kind_named("contact")((0, 1), {"start": 0.1, "end": 0.4}, ("only",))
    parts = Split((run("only", block=1),), (sealed,), sealed.name, (0,), ("only",))
    found = assumptions([effect], parts, model(**declared))
    assert [(each.kind, each.present) for each in found] == [("contact", False)] * told
