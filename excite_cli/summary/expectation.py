"""What planned motions are expected to tell, for people and for `--json`."""

from typing import Any

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.diagnosis.expectation import Expectation
from excite_cli.diagnosis.power import EffectPower
from excite_cli.excitation.prediction import NOISE
from excite_cli.excitation.problem import Problem
from excite_cli.shown.answer import Parts, Table

_MOST = 10.0  # times the usual torque: no robot has more of an effect


def expectation_parts(problem: Problem, found: Expectation, asked: bool) -> Parts:
    """Predicted deviation after every motion, and the sizes of effects that would be named."""
    after = ", ".join(f"{each:.2g}" for each in found.deviations)
    numbers = f"motion {len(found.deviations)}" if len(found.deviations) == 1 else "each motion"
    beside = "" if found.all_data else ", earlier data aside"
    words = (
        f"Predicted torques deviate by {after} times the noise of one sample after {numbers} "
        f"(RMS, {where_in_words(problem)}{beside})."
    )
    noise = noise_in_words(problem.spec)
    table = _asked_table(found.power, noise) if asked else power_table(found.power, noise)
    return [words, table]


def noise_in_words(spec: Spec) -> str:
    """Which noise of the torques these figures were made with."""
    given, rate = spec.criterion.row_weights, spec.task.rate
    level = "1/criterion.row_weights" if isinstance(given, dict) else f"{NOISE:.0%} of that torque"
    return f"noise: {level} in {rate:g} independent samples a second"


def where_in_words(problem: Problem) -> str:
    """The states whose torques are predicted."""
    task = problem.spec.task
    if task.log or task.plan:
        return f"at the states of {task.log or task.plan}"
    if task.position or task.speed < 1.0 or task.acceleration < 1.0:
        return "at states of the region of `task`"
    return "at states within the limits"


def power_table(power: tuple[EffectPower, ...], noise: str) -> Table:
    """Of every kind the joints on which the smallest and the largest size would be named."""
    rows = []
    for kind in dict.fromkeys(each.kind for each in power):
        of = [each for each in power if each.kind == kind]
        best = min(of, key=lambda each: each.share)
        worst = max(of, key=lambda each: each.share)
        rows.append((kind, _share(best), ", ".join(best.joints), _share(worst), _joints(worst)))
    return Table(
        "Effects that a diagnosis would name with 95%: size as a share of the "
        f"joint's usual torque ({noise})",
        ("effect", "size", "most visible on", "size there", "least visible on"),
        tuple(rows),
        left=("effect", "most visible on", "least visible on"),
    )


def _share(each: EffectPower) -> str:
    return f"{each.share:.2%}" if each.share < _MOST else "not shown"


def _joints(each: EffectPower) -> str:
    return ", ".join(each.joints)


def _asked_table(power: tuple[EffectPower, ...], noise: str) -> Table:
    rows = tuple(
        (each.kind, _joints(each), f"{each.size:.3g}", each.unit, f"{each.power:.0%}")
        for each in power
    )
    return Table(
        f"Probability that a diagnosis names it ({noise})",
        ("effect", "on", "size", "unit", "named"),
        rows,
        left=("effect", "on", "unit"),
    )


def power_data(power: tuple[EffectPower, ...]) -> list[dict[str, Any]]:
    """Effects with the size that is named with the probability `power`; None: no size is."""
    return [
        {
            "kind": each.kind,
            "joints": list(each.joints),
            "parameter": each.parameter,
            "size": each.size if np.isfinite(each.size) else None,
            "unit": each.unit,
            "share_of_torque": each.share if np.isfinite(each.share) else None,
            "power": each.power,
        }
        for each in power
    ]
