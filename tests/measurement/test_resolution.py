"""Torques in steps: how large they are, and which say nothing."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.measurement.resolution import lattice_step
from tests.measurement.recordings import check, only, recorded


@pytest.mark.parametrize("step", [5.0, 0.31, 0.02])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_steps_are_found_from_the_values(step: float, kind: type) -> None:
    values = (step * np.round(recorded().tau[:, 0] / step) + 0.7).astype(kind)
    assert lattice_step(values.astype(float)) == pytest.approx(step, rel=1e-5)


def test_what_comes_in_no_steps() -> None:
    tau = recorded().tau[:, 0]
    assert lattice_step(tau) == 0.0
    assert lattice_step(np.repeat(tau, 4)) == 0.0
    assert lattice_step(np.full(100, 3.0)) == 0.0


def test_coarse_torques_are_told_and_kept_with_the_run() -> None:
    run = recorded()
    (back,), findings = check(replace(run, tau=np.round(run.tau / 5.0) * 5.0))
    found = only(findings, "torque_steps")
    assert found.severity == "warning"
    assert "shoulder of 5 (" in found.text
    assert back.torque_step is not None
    np.testing.assert_allclose(back.torque_step, 5.0)
    (fine,), findings = check(replace(run, tau=np.round(run.tau / 0.1) * 0.1))
    assert findings == []
    assert fine.torque_step is not None


def test_a_torque_that_is_mostly_one_number() -> None:
    run = recorded()
    tau = run.tau - np.median(run.tau, axis=0)
    tau[np.abs(tau[:, 1]) < np.quantile(np.abs(tau[:, 1]), 0.8), 1] = 0.0
    (found,) = [f for f in check(replace(run, tau=tau))[1] if f.kind != "stuck"]
    assert (found.kind, found.severity) == ("mostly_constant", "warning")
    assert found.joints == ("elbow",)
    assert "exactly 0 in 80% of the samples" in found.text
    assert "measurement.without_torque" in found.text
