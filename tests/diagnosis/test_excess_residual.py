"""What is left beside the noise is said: never of noise alone, always of more."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from excite_cli.diagnosis.excess_residual import excess_residuals
from excite_cli.diagnosis.records import ExcessResidual
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Signals
from excite_cli.identification.noise_floor import NoiseFloor
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array

RATE, SECONDS = 200.0, 12.0
PROCESSING = Processing(RATE, 8.0, 4.8, 19.2, 4, 0.2, "differentiated", 0.02, 0.8)
NOISE = 0.5


def motion(number: int) -> tuple[Array, Array]:
    rng = np.random.default_rng([number, 6])
    t = np.arange(SECONDS * RATE) / RATE
    rate, phase = rng.uniform(0.8, 3.0, (3, 2)), rng.uniform(0.0, 6.0, (3, 2))
    return t, np.sin(rate * t[:, None, None] + phase).sum(1)


def left(
    size: float,
    filtered: bool = False,
    floor: NoiseFloor | None = None,
    slow: float = 0.0,
    single: float = 0.0,
    reversal: float = 0.0,
) -> tuple[ExcessResidual, ...]:
    """Noise; on joint a a map of both angles, or of a `single` one; on b a wave of its own.

    `reversal`: on joint a, within 0.055 s of every change of its direction.
    """
    recorded, signals, prepared, residuals = [], [], [], []
    rng = np.random.default_rng(3)
    for number in range(3):
        t, q = motion(number)
        more = NOISE * rng.normal(size=q.shape)
        if filtered:
            more = 5 * sosfiltfilt(butter(6, 9.0, fs=RATE, output="sos"), more, axis=0)
        more[:, 0] += size * np.sin(1.5 * q[:, 0]) * np.cos(1.5 * q[:, 1])
        more[:, 0] += single * np.sin(2.0 * q[:, 1])
        more[:, 1] += slow * np.sin(14.0 * t + 3.0 * rng.normal(size=len(t)).cumsum() / RATE)
        turned = np.flatnonzero(np.diff(np.sign(np.gradient(q[:, 0]))))
        for k in range(-11, 12):
            more[np.clip(turned + k, 0, len(t) - 1), 0] += reversal
        run = Run(f"run_{number}", t, q, 5.0 * q + more)
        fit = prepare(run, PROCESSING)
        alone = prepare(replace(run, tau=more), PROCESSING)
        recorded.append(run)
        prepared.append(fit)
        residuals.append(alone.tau_fit)
        signals.append(
            Signals(fit.t, fit.q, fit.v, fit.a, 5 * fit.q, 5 * fit.q, None, fit.run)  # type: ignore[arg-type]
        )
    nothing = tuple(np.zeros((*r.shape, 1)) for r in residuals)
    data = TrainingData(tuple(prepared), (0, 1, 2), nothing, tuple(r.tau_fit for r in prepared))
    predicted = [5.0 * run.q for run in prepared]
    model = SimpleNamespace(robot=SimpleNamespace(joint_names=("a", "b")))
    traced: Any = SimpleNamespace(data=data, signals=signals, model=model)
    return excess_residuals(traced, predicted, residuals, recorded, PROCESSING, floor)[0]


def test_what_is_left_beside_the_noise_is_said() -> None:
    assert left(0.0) == ()
    # An unknown map is said with its two quantities.
    (rest,) = left(2.0)
    assert (rest.joint, rest.certain, rest.basis) == ("a", True, "band")
    assert {each.code for each in rest.depends_on} == {"q[a]", "q[b]"}
    assert rest.noise is not None
    assert rest.rms > 2.5 * rest.noise
    assert rest.predictable > 0.6
    # What no quantity predicts is said all the same.
    (rest,) = left(0.0, slow=2.0)
    assert (rest.joint, rest.certain, rest.depends_on) == ("b", True, ())


def test_repeated_periods_know_the_noise_best() -> None:
    known = NoiseFloor(np.array([10.0, 0.01]), np.zeros(2))
    (rest,) = left(0.0, floor=known)
    assert (rest.joint, rest.basis, rest.noise) == ("b", "periods", 0.01)
    assert rest.certain
    # Noise of unknown size is no certainty.
    found = left(0.0, filtered=True)
    assert [each.joint for each in found] == ["a", "b"]
    assert all(each.noise is None and not each.certain for each in found)


@pytest.mark.parametrize("single", [0.0, 4.0])
def test_less_than_the_noise_is_said_if_it_is_predicted(single: float) -> None:
    loud = NoiseFloor(np.array([10.0, 10.0]), np.zeros(2))
    assert [each.joint for each in left(0.0, floor=loud, single=single)] == ["a"] * bool(single)


def test_what_is_left_around_reversals_alone_is_told_apart() -> None:
    (rest,) = left(0.0, reversal=10.0)
    assert (rest.joint, rest.at_reversals, rest.certain) == ("a", True, False)
    assert rest.noise is not None
    assert rest.rms > 1.6 * rest.noise
    assert not any(each.at_reversals for each in left(2.0))
