"""Instants of the cost and of the constraints, filled in from the trajectory where not given."""

import math

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import GridSpec, SamplingSpec
from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError
from excite_cli.trajectory.base import Trajectory

# With two to a coefficient, a motion is shaped to its instants: TALOS' arms have 5.15 on them and
# 5.56 on twenty times as many; with four 5.20 on both.
_COST_SAMPLES, _PER_COEFFICIENT = 40, 4
_CONSTRAINT_STEP, _FEWEST, _MOST = 0.02, 100, 1000
_ROUNDING = 1e-5
_LONGEST = 3600.0
_MOST_VALUES = 2_000_000  # samples times coefficients of a joint


def with_sampling(spec: Spec, trajectory: Trajectory) -> Spec:
    """`spec` with all samples and steps given.

    Raises
    ------
    ConfigError
        Samples last longer than the trajectory, or constraint samples leave a part of it out.
    """
    duration = trajectory.duration
    if duration > _LONGEST:
        raise ConfigError(
            f"trajectory: {duration:g} s is longer than the {_LONGEST:g} s that are allowed. Take "
            "a higher base_frequency, or several motions."
        )
    usual = max(_COST_SAMPLES, _PER_COEFFICIENT * trajectory.n_coefficients)
    cost = _filled(spec.sampling.cost, usual, duration)
    usual = int(np.clip(round(duration / _CONSTRAINT_STEP), _FEWEST, _MOST))
    grid = _filled(spec.sampling.constraints, usual, duration)
    for name, section in (("cost", cost), ("constraints", grid)):
        samples, step = _both(section)
        if samples * trajectory.n_coefficients > _MOST_VALUES:
            raise ConfigError(
                f"sampling.{name}: {samples:,} samples of {trajectory.n_coefficients} coefficients "
                f"are more than fits in memory with all that is computed of them (up to "
                f"{_MOST_VALUES:,}). Take fewer samples or a larger step."
            )
        if (samples - 1) * step > duration * (1 + _ROUNDING):
            raise ConfigError(
                f"sampling.{name}: {samples} samples every {step:g} s last longer than the "
                f"trajectory ({duration:g} s). Take fewer samples or a smaller step."
            )
    samples, step = _both(grid)
    if samples * step < duration * (1 - _ROUNDING):
        raise ConfigError(
            f"sampling.constraints: {samples} samples every {step:g} s cover {samples * step:g} s "
            f"of a trajectory of {duration:g} s; the constraints would not hold in the remaining "
            "time. Take more samples or a larger step, or leave one of the two out."
        )
    sampling = SamplingSpec(cost=cost, constraints=grid)
    return spec.model_copy(update={"sampling": sampling})


def instants(grid: GridSpec) -> Array:
    """Times (samples,) [s] of a grid that `with_sampling` has filled."""
    samples, step = _both(grid)
    return np.arange(samples, dtype=float) * step


def _both(grid: GridSpec) -> tuple[int, float]:
    assert grid.samples is not None
    assert grid.step is not None
    return grid.samples, grid.step


def _filled(grid: GridSpec, usual: int, duration: float) -> GridSpec:
    samples, step = grid.samples, grid.step
    if samples is None:
        samples = usual if step is None else max(2, math.ceil(duration / step - _ROUNDING))
    step = step if step is not None else duration / samples
    return GridSpec.model_construct(samples=samples, step=step)
