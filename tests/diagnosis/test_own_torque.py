"""Columns that look at the model's own torque, until what is fitted is what is predicted."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis import own_torque
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.own_torque import at_its_own_torque
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import effect, planted, traced


@pytest.mark.parametrize("gain", [0.1, -0.3, 0.6])
def test_a_gain_of_what_is_found_beside_it_is_fitted_as_it_predicts(
    monkeypatch: pytest.MonkeyPatch, gain: float
) -> None:
    """τ = (1 + g) (c₁ f + c₂ h): the gain's column is what the other two are in the last fit."""
    effects = [effect("viscous_friction"), effect("armature"), effect("torque_gain")]
    data, candidates = planted(effects, np.zeros((3, 2)))
    first, second = (c.columns for c in candidates[:2])
    whole = [3.0 * f + 1.0 * h for f, h in zip(first, second, strict=True)]
    # The rigid body's torque, which the gain scales too and nothing else explains.
    load = [np.asarray(5.0 * each) for each in candidates[2].columns]
    tau = [
        t + np.pad(((1.0 + gain) * w + gain * at)[:, :, 0], ((0, 0), (0, 1)))
        for t, w, at in zip(data.tau, whole, load, strict=True)
    ]
    data = replace(data, tau=tuple(tau))

    def at(theta: Array) -> list[Candidate]:
        now = [theta[-3] * f + theta[-2] * h for f, h in zip(first, second, strict=True)]
        own = tuple(n + each for n, each in zip(now, load, strict=True))
        return [*candidates[:2], replace(candidates[2], columns=own)]

    def with_columns(given: SearchResult, bodies: Any, theta: Array) -> SearchResult:
        return replace(given, candidates=tuple(at(theta)))

    monkeypatch.setattr(own_torque, "_with_columns", with_columns)
    start = traced(data, at(np.zeros(9)), (0, 1, 2))
    found = at_its_own_torque(start, [])
    theta = found.fitted(found.chosen)
    assert theta[-3:] == pytest.approx([3.0, 1.0, gain], abs=0.1)
    # A fit at the first columns: sizes of a gain that is not there.
    rough = start.fitted(start.chosen)
    assert abs(rough[-3] - 3.0) > 0.1
