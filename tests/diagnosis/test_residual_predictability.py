"""Structure without a name: maps of one and two quantities are predicted, and noise is not."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.residual_predictability import Quantities, Rest, histories
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
        (lambda s: np.sign(s.v[:, 0]) * (s.run.name == "run_2"), {"run"}),
    ],
)
def test_what_a_residual_is_a_function_of(made: Map, expected: set[str]) -> None:
    structure = rest_of(made, white(0.1)).structure()
    assert {each.code for each in structure.depends_on} == expected
    assert structure.named > 0.6
    assert structure.predictable >= structure.named


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


SHARES = (0.05, 0.15, 0.4)
PATHS = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=40)
EASY = settings(max_examples=60, deadline=None, derandomize=True)


def slow(x: Array, radius: float) -> Array:
    """x less the place of a ring of this half-width, which x, a pin within it, pushes about."""
    ring, found = float(x[0]), []
    for pin in x:
        if pin > ring + radius:
            ring = float(pin) - radius
        elif pin < ring - radius:
            ring = float(pin) + radius
        found.append(float(pin) - ring)
    return np.array(found)


def of_path(path: list[float] | Array) -> tuple[Array, Array]:
    """Histories (T, 3) of a single path, and the half-widths (3,)."""
    x = np.array(path, dtype=float)
    return histories([x[:, None]])[0][:, 0], 0.5 * float(np.ptp(x)) * np.array(SHARES)


def test_histories_are_those_of_the_slow_rule_with_common_widths() -> None:
    """Three runs of different length; amplitudes are those of all runs, joint by joint."""
    rng = np.random.default_rng(0)
    signals = [np.cumsum(rng.normal(size=(t, 2)) * [1.0, 30.0], axis=0) for t in (300, 50, 120)]
    every = np.concatenate(signals)
    amplitude = 0.5 * (every.max(axis=0) - every.min(axis=0))
    found = histories(signals)
    for x, parts in zip(signals, found, strict=True):
        assert parts.shape == (*x.shape, 3)
        for joint in range(2):
            for k, share in enumerate(SHARES):
                expected = slow(x[:, joint], share * amplitude[joint])
                assert parts[:, joint, k] == pytest.approx(expected, abs=1e-12)


@EASY
@given(PATHS)
def test_the_part_within_the_play_is_bounded_and_starts_in_the_middle(path: list[float]) -> None:
    parts, radii = of_path(path)
    assert (parts[0] == 0.0).all()
    assert (np.abs(parts) <= radii + 1e-12).all()


@EASY
@given(PATHS)
def test_what_moves_on_in_one_direction_has_no_hysteresis(path: list[float]) -> None:
    """Once x has moved by r, the play is taken up and what is within it stays at ±r."""
    for direction in (1.0, -1.0):
        x = direction * np.sort(path)
        x = x if direction > 0 else x[np.argsort(-x)]
        parts, radii = of_path(x)
        for k, radius in enumerate(radii):
            taken_up = np.abs(x - x[0]) >= radius
            assert parts[taken_up, k] == pytest.approx(np.sign(x[-1] - x[0]) * radius, abs=1e-9)
            assert parts[~taken_up, k] == pytest.approx(x[~taken_up] - x[0], abs=1e-9)


@EASY
@given(PATHS)
def test_speed_does_not_matter(path: list[float]) -> None:
    """The same way sampled at twice and at three times as many instants."""
    parts, _ = of_path(path)
    for times in (2, 3):
        dense = np.interp(np.arange(times * (len(path) - 1) + 1) / times, range(len(path)), path)
        assert of_path(dense)[0][::times] == pytest.approx(parts, abs=1e-9)


@EASY
@given(PATHS, st.floats(0.1, 50.0), st.floats(-10.0, 10.0))
def test_units_and_zeros_do_not_matter(path: list[float], unit: float, zero: float) -> None:
    parts, _ = of_path(path)
    assert of_path(unit * np.array(path) + zero)[0] == pytest.approx(unit * parts, abs=1e-9)
    assert of_path(-np.array(path))[0] == pytest.approx(-parts, abs=1e-9)


def test_a_repeated_swing_encloses_a_loop_whose_area_is_known() -> None:
    """x goes to and fro between ±1: ∮ parts dx = 4 r (1 − r), the energy a play loses."""
    swing = np.concatenate([np.linspace(-1, 1, 2001), np.linspace(1, -1, 2001)[1:]])
    parts, _ = of_path(np.concatenate([swing, swing[1:]]))
    second = parts[len(swing) - 1 :]
    middle = 0.5 * (second[1:] + second[:-1])
    area = np.sum(middle * np.diff(swing)[:, None], axis=0)
    radii = np.array(SHARES)
    assert area == pytest.approx(4 * radii * (1 - radii), rel=2e-3)
    # What stands has no history.
    (parts,) = histories([np.full((5, 2), 3.0)])
    assert np.array_equal(parts, np.zeros((5, 2, 3)))


def test_too_few_samples_say_nothing() -> None:
    with pytest.raises(AssertionError):
        rest_of(nothing, white(1.0, samples=15), 15)
