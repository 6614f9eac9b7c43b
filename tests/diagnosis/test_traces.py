"""What a diagnosis keeps of its data agrees with what it says."""

import numpy as np
import pytest

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Diagnosis
from tests.diagnosis.simulated_arm import ELBOW, planted, played, told

VISCOUS, COULOMB, CURVED = 2.0, 1.5, 4.0


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    """An arm with friction of three parts on its third joint."""
    effects = [
        planted("viscous_friction", ELBOW, VISCOUS),
        planted("coulomb_friction", ELBOW, COULOMB),
        planted("nonlinear_viscous_friction", ELBOW, CURVED, power=0.5),
    ]
    return told(played(effects), "viscous_friction,coulomb_friction,nonlinear_viscous_friction")


def test_traces_are_what_the_errors_say(found: Diagnosis) -> None:
    (held_out,) = found.held_out_traces
    assert (held_out.run, held_out.held_out) == ("r3", True)
    assert held_out.before is not None
    for errors, model in ((found.before, held_out.before), (found.after, held_out.predicted)):
        left = held_out.measured - model
        for j, name in enumerate(found.joint_names):
            assert errors.rms[name] == pytest.approx(np.sqrt(np.nanmean(left[:, j] ** 2)), rel=1e-3)
    assert found.traces is not None
    assert [(t.run, t.held_out) for t in found.traces.runs] == [("r1", False), ("r2", False)]
    for trace in found.traces.runs:
        assert trace.before is not None
        at = trace.counted[:, ELBOW]
        before, after = (
            np.sum((trace.measured - model)[at, ELBOW] ** 2)
            for model in (trace.before, trace.predicted)
        )
        assert after < 0.05 * before


def test_partial_residuals_follow_the_laws_that_are_reported(found: Diagnosis) -> None:
    assert found.traces is not None
    traces = {(t.kind, t.joints): t for t in found.traces.effects}
    assert set(traces) == {(e.effect.kind, e.effect.joints) for e in found.effects}
    for named in found.effects:
        trace = traces[named.effect.kind, named.effect.joints]
        assert trace.rows == named.effect.joints
        seen = np.isfinite(trace.partial[:, 0])
        x, own, partial = (a[seen, 0] for a in (trace.x, trace.own, trace.partial))
        assert np.sum((partial - own) ** 2) < 0.2 * np.sum(partial**2), trace.kind
        if trace.kind == "viscous_friction":  # the model's own term, not the line through all
            assert named.parameters["viscous"].value == pytest.approx(VISCOUS, rel=0.05)
            assert own == pytest.approx(named.parameters["viscous"].value * x, rel=1e-3, abs=1e-3)
            assert (trace.quantity, trace.unit) == ("speed", "rad/s")
    # The parts of friction add up.
    assert found.traces is not None
    parts = [t for t in found.traces.effects if t.quantity == "speed" and t.rows == t.joints]
    parts = [t for t in parts if t.rows == (found.joint_names[2],)]
    assert len(parts) == 3
    seen = np.isfinite(parts[0].own[:, 0])
    v = parts[0].x[seen, 0]
    whole = np.sum([t.own[seen, 0] for t in parts], axis=0)
    true = VISCOUS * v + COULOMB * np.sign(v) + CURVED * np.sign(v) * np.sqrt(np.abs(v))
    fast = np.abs(v) > 0.1
    assert whole[fast] == pytest.approx(true[fast], rel=0.03, abs=0.1)


def test_the_map_of_dependences(found: Diagnosis) -> None:
    assert found.traces is not None
    dependence = found.traces.dependence
    assert dependence.joints == found.joint_names
    n = len(found.joint_names)
    assert len(dependence.quantities) == 2 + 3 * n + 3
    assert dependence.quantities[0] == Covariate("time")
    assert dependence.quantities[-1].code == "own history of load"
    assert dependence.shares.shape == (n, len(dependence.quantities))
    assert ((dependence.shares >= 0) & (dependence.shares <= 1)).all()
