"""Structure without a name: maps of one and two quantities are predicted, and noise is not."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.residual_predictability import Quantities, Rest
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Signals
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import prepared

NAMES = ("a", "b")
STEP, SAMPLES, RUNS = 0.1, 100, 3
Map = Callable[[Signals], Array]


def signals(number: int, samples: int = SAMPLES) -> Signals:
    """Smooth random motion of two joints."""
    rng = np.random.default_rng([number, 3])
    t = STEP * np.arange(samples)
    rate, phase = rng.uniform(0.8, 3.0, (3, 2)), rng.uniform(0.0, 6.0, (3, 2))
    angle = rate * t[:, None, None] + phase
    q, v = np.sin(angle).sum(1), (rate * np.cos(angle)).sum(1)
    a = -(rate**2 * np.sin(angle)).sum(1)
    load = 3.0 * np.cos(q) + a
    return Signals(t, q, v, a, load, load, None, RunId(f"run_{number}"))  # type: ignore[arg-type]


def rest_of(made: Map, noise: list[Array], samples: int = SAMPLES) -> Rest:
    """Joint a leaves what is `made` of the signals, and noise."""
    every = [signals(number, samples) for number in range(RUNS)]
    usable = np.ones((samples, 2), bool)
    runs = tuple(prepared(usable, s.q, s.v) for s in every)
    for run, s in zip(runs, every, strict=True):
        object.__setattr__(run, "run", s.run)
        object.__setattr__(run, "step", STEP)
    data = TrainingData(
        runs, tuple(range(RUNS)), tuple(np.zeros((samples, 2, 1)) for _ in runs),
        tuple(np.zeros((samples, 2)) for _ in runs),
    )  # fmt: skip
    residuals = [np.stack([made(s) + e, e], axis=1) for s, e in zip(every, noise, strict=True)]
    found = Quantities(data, every, NAMES).rest(0, residuals)
    assert found is not None
    return found


def white(size: float, seed: int = 1, samples: int = SAMPLES) -> list[Array]:
    rng = np.random.default_rng([seed, 8])
    return [size * rng.normal(size=samples) for _ in range(RUNS)]


def nothing(s: Signals) -> Array:
    return np.zeros(len(s.t))


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (lambda s: np.sin(2.0 * s.q[:, 1]), {"q[b]"}),
        (lambda s: np.sin(1.5 * s.q[:, 0]) * np.cos(1.5 * s.q[:, 1]), {"q[a]", "q[b]"}),
        (lambda s: s.v[:, 0] * np.sin(s.q[:, 1]), {"v[a]", "q[b]"}),
        (lambda s: s.load[:, 0] * np.sin(1.5 * s.q[:, 1]), {"load[a]", "q[b]"}),
    ],
)
def test_what_a_residual_is_a_function_of(made: Map, expected: set[str]) -> None:
    structure = rest_of(made, white(0.1)).structure()
    assert {each.code for each in structure.depends_on} == expected
    assert structure.named > 0.6
    assert structure.predictable >= structure.named


def test_friction_of_one_run_depends_on_the_run() -> None:
    def made(s: Signals) -> Array:
        return np.sign(s.v[:, 0]) * (s.run.name == "run_2")

    structure = rest_of(made, white(0.1)).structure()
    assert Covariate("run") in structure.depends_on


@pytest.mark.parametrize("memory", [0.0, 0.5])
def test_noise_is_not_predicted(memory: float) -> None:
    """Samples are 0.1 s apart; a coefficient of 0.97 at 500 Hz leaves 0.22 over such a time."""
    for seed in range(3):
        noise = [lfilter([1.0], [1.0, -memory], e) for e in white(1.0, seed)]
        rest = rest_of(nothing, noise)
        assert rest.predictable < 0.1
    assert rest.structure().named < 0.15


def test_every_second_is_predicted_from_all_others() -> None:
    """The short cut gives what a fit without that second gives."""
    rest = rest_of(lambda s: np.sin(s.q[:, 1]), white(0.3))
    kernel = rest.kernels[Covariate("position", "b")]
    weighted, y, left = rest.direction * kernel, rest.residual, 0.0
    for block in np.unique(rest.block):
        out = rest.block == block
        inner = weighted[np.ix_(~out, ~out)] + 0.1 * np.eye(int(np.sum(~out)))
        predicted = weighted[np.ix_(out, ~out)] @ np.linalg.solve(inner, y[~out])
        left += float(np.sum((y[out] - predicted) ** 2))
    assert rest._left(weighted, 0.1) == pytest.approx(left, rel=1e-9)


def test_long_data_are_represented_by_stretches() -> None:
    samples = 4_000
    rest = rest_of(lambda s: np.sin(2.0 * s.q[:, 1]), white(0.1, samples=samples), samples)
    assert 200 <= len(rest.residual) <= 400
    assert np.all(np.diff(rest.block) >= 0)
    assert rest.structure().depends_on == (Covariate("position", "b"),)


def test_too_few_samples_say_nothing() -> None:
    with pytest.raises(AssertionError):
        rest_of(nothing, white(1.0, samples=15), 15)
