"""Columns at the torque of the model that was found.

Some effects look at the model's own torque: a gain is a share of it, a delay its slope, friction
grows with it. A pass has their columns at the fit of the pass before, which had other effects; what
is fitted with them need not be what the model then predicts. So the fit is repeated with the
columns C(θ) of its own torque until the energy that is really left, ‖τ − C(θ) θ‖², is that of the
fit, ‖τ − C θ‖²; where it grows, by half a step.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.candidates import with_columns
from excite_cli.diagnosis.modelled_run import ModelledRun, signals_of_all, training_data
from excite_cli.diagnosis.search_loop import values_of
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.robot.model import Array

_ROUNDS = 8
_SETTLED = 1.02  # times the energy of the fit: 1 % of the error


def at_its_own_torque(traced: SearchResult, bodies: Sequence[ModelledRun]) -> SearchResult:
    """The same effects with columns at their own torque."""
    chosen = traced.chosen
    if not chosen:
        return traced
    theta = before = traced.fitted(chosen)
    best, least = traced, np.inf
    for _ in range(_ROUNDS):
        now = _with_columns(traced, bodies, theta)
        left = _energy(now, theta)
        if left < least:
            best, least, before = now, left, theta
            theta = now.fitted(chosen)
            if left <= _SETTLED * _energy(now, theta):
                break
        else:
            theta = (theta + before) / 2.0
    return best


def _energy(traced: SearchResult, theta: Array) -> float:
    """What is left of the training data, in units of each joint's noise."""
    left = traced.data.residuals(traced.candidates, traced.chosen, theta)
    runs = traced.data.runs
    return float(
        sum(
            np.square((each / traced.levels)[run.usable]).sum()
            for each, run in zip(left, runs, strict=True)
        )
    )


def _with_columns(
    traced: SearchResult, bodies: Sequence[ModelledRun], theta: Array
) -> SearchResult:
    model, effects = traced.model, traced.effects
    phi, values = model.full_inertias(theta), values_of(model, traced.data, theta)
    signals = signals_of_all(bodies, phi, (*model.declared, *effects), values)
    data = training_data(model, traced.data.folds, bodies, signals)
    tests = [traced.candidates[i].tests for i in traced.chosen]
    made = with_columns(list(zip(effects, tests, strict=True)), signals, data.runs)
    fresh = {each.place: each for each in made}
    candidates = list(traced.candidates)
    for i in traced.chosen:
        candidates[i] = fresh.get(candidates[i].place, candidates[i])
    return replace(traced, data=data, candidates=tuple(candidates), phi=phi, signals=tuple(signals))
