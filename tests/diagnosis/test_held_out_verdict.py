"""The verdict on what an effect removes from the error on held-out data."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.held_out_verdict import held_out_verdict, removed_in_draws
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.identification.identified_model import Prediction
from excite_cli.identification.prepare import PreparedRun
from tests.diagnosis.explicit_data import STEP, prepared

SURE = np.linspace(0.01, 0.03, 1000)
UNSURE = np.linspace(-0.002, 0.03, 1000)  # a sixteenth of the draws says the opposite


@pytest.mark.parametrize(
    ("sign", "verdict"), [(1.0, HeldOutVerdict.CONFIRMED), (-1.0, HeldOutVerdict.HARMFUL)]
)
def test_what_nearly_all_draws_say_is_the_verdict(sign: float, verdict: HeldOutVerdict) -> None:
    """The error where joints stand must not contradict."""
    assert held_out_verdict(sign * SURE, 0.02 * sign) is verdict
    for draws, whole in ((sign * UNSURE, sign), (sign * SURE, -sign), (np.zeros(0), 1.0)):
        assert held_out_verdict(draws, 0.02 * whole) is HeldOutVerdict.NOT_CONFIRMED


def recording(seconds: float, still: bool = False) -> tuple[PreparedRun, Prediction, Prediction]:
    """A run of two joints, a prediction that is 2 % off, and one that is 1 % off."""
    shape = (round(seconds / STEP), 2)
    rng = np.random.default_rng(2)
    tau = 5.0 + rng.normal(size=shape)
    run = prepared(np.ones(shape, bool), tau=tau)
    if still:
        run = replace(run, moving=np.zeros(shape, bool))
    errors = rng.normal(size=shape) * np.sqrt(np.mean(tau**2))
    worse, better = (Prediction(tau, tau + share * errors) for share in (0.02, 0.01))
    return run, worse, better


def test_draws_tell_what_is_removed_from_the_mean_relative_error() -> None:
    """Of all joints, or of those beside one."""
    run, worse, better = recording(5.0)
    assert removed_in_draws([run], [worse], [better]).mean() == pytest.approx(0.01, rel=0.1)
    assert removed_in_draws([run], [better], [worse]).max() < 0.0
    torque = np.column_stack([better.torque[:, 0], worse.torque[:, 1]])
    one = replace(better, torque=torque)  # on the first joint alone
    assert removed_in_draws([run], [worse], [one]).min() > 0.0
    assert np.all(removed_in_draws([run], [worse], [one], beside=0) == 0.0)
    assert removed_in_draws([run], [worse], [one], beside=1).min() > 0.0
    # Few blocks are no evidence nor is a robot that stands. Four blocks, of 0.2 s at least, may
    # agree by chance.
    for run, worse, better in (recording(0.8), recording(5.0, still=True)):
        assert len(removed_in_draws([run], [worse], [better])) == 0
    run, worse, better = recording(1.0)
    assert len(removed_in_draws([run], [worse], [better])) > 0
