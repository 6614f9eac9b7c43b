"""Whether a filter that was set biases: the same model fitted behind the automatic one, compared.

Standard deviations know the noise of torques. Noise of positions, which differentiation enlarges
where no filter holds it back, and what a filter takes from the motion are errors of the columns:
they move the parameters, and no deviation says so. With x ± s behind the filter that was set and
x_a ± s_a behind the automatic one,

    z_i = |x − x_a|_i / √(s² + s_a²)_i.

Both see the same noise of the torque, which moves both alike: z stays small unless one of the
filters biases. That one leaves more unexplained, so that less is known behind it: the filter that
was set is named where median(s / s_a) is not clearly below 1.
"""

from collections.abc import Callable, Sequence

import numpy as np

from excite_cli.config.data_spec import FilterSpec, IdentificationSpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.errors import ExciteError
from excite_cli.identification.fit import Fit, fit
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.regression import regression_on
from excite_cli.identification.torque_scale import Knowledge
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.robot.model import Robot

Fitted = Callable[[Processing], Fit]

# Simulated arms: at most 2.9 behind filters that cover as the automatic one does, at least 3.2
# behind those that do not.
_DIFFERENT = 3.0
# Deviations behind a better filter than the automatic one: 0.3 to 0.82 of those behind that one.
_LESS_CERTAIN = 0.9
_NAMED = 3
# What may bias, by its key of measurement.filter.
_KEYS = {"position": "position_cutoff", "parallel": "parallel_cutoff", "velocity": "velocity"}


def fitted_behind(
    robot: Robot,
    base: BaseParameters,
    known: Knowledge,
    spec: IdentificationSpec,
    runs: Sequence[Run],
) -> Fitted:
    """The fit of what is `known` to `runs`, behind any filter."""
    plain = spec.model_copy(update={"consistent": False})

    def behind(processing: Processing) -> Fit:
        regression = regression_on(robot, base, known.effects, runs, processing)
        return fit(regression, plain, (known.rows, known.target))

    return behind


def filter_findings(
    runs: Sequence[Run],
    chosen: Processing,
    spec: FilterSpec,
    fitted: Fitted,
    found: Fit | None = None,
) -> tuple[Finding, ...]:
    """A warning where the filter of `spec` biases what is fitted to `runs`; nothing if it may not.

    `fitted` gives the fit behind any filter; `found` is the one behind `chosen`, where it is known.
    """
    if spec == FilterSpec():
        return ()
    try:
        automatic = choose_processing(runs, FilterSpec(), chosen.moving_speed)
        keys = [k for k, name in _KEYS.items() if getattr(automatic, name) != getattr(chosen, name)]
        if not keys:
            return ()
        other = fitted(automatic)
        found = fitted(chosen) if found is None else found
    except ExciteError:  # the automatic filter is not for these data: nothing can be compared
        return ()
    known = np.isfinite(found.std) & np.isfinite(other.std) & (found.std > 0) & (other.std > 0)
    if not known.any():
        return ()
    both = np.hypot(found.std[known], other.std[known])
    far = np.abs(found.values - other.values)[known] / both
    wider = float(np.median(found.std[known] / other.std[known]))
    if far.max() < _DIFFERENT or wider < _LESS_CERTAIN:
        return ()
    names = [name for name, one in zip(found.names, known, strict=True) if one]
    worst = np.argsort(-far)[:_NAMED].tolist()
    moved = ", ".join(f"{names[k]} by {far[k]:.2g}" for k in worst if far[k] >= _DIFFERENT)
    leave_out = " and ".join(f"measurement.filter.{key}" for key in keys)
    text = (
        f"the filter that was set ({_in_words(chosen)}) biases: behind the automatic one "
        f"({_in_words(automatic)}) {int((far >= _DIFFERENT).sum())} of {len(far)} parameters "
        f"differ by more than {_DIFFERENT:g} of their standard deviations ({moved}). Standard "
        "deviations know neither the noise of differentiated positions nor the motion that a "
        f"filter takes away; here they are {wider:.2g} times those behind the automatic filter. "
        f"Leave out {leave_out}"
    )
    return (Finding("filter_bias", "warning", text),)


def _in_words(processing: Processing) -> str:
    def cutoff(frequency: float | None) -> str:
        return "none" if frequency is None else f"{frequency:.3g} Hz"

    words = f"positions {cutoff(processing.position_cutoff)}"
    words += f", torque and columns {cutoff(processing.parallel_cutoff)}"
    return words + (", measured speeds" if processing.velocity == "measured" else "")
