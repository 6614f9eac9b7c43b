"""A clock that is off, and torques that come late, as the dynamics show them.

With a recorded second that lasts c seconds, speeds are v/c and accelerations a/c². Inertias and
friction adapt to that; what does not is gravity: the same masses that are accelerated are weighed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.setup import LAGS, Setup
from excite_cli.checks.setup_check import CLEAR, Alternative, Settings, SetupCheck, descended
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec

_CLOCKS = (0.25, 0.5, 0.7, 0.85, 0.93, 1.07, 1.18, 1.4, 2.0, 4.0)
_FINE_CLOCK = (0.05, 0.025, 0.012, 0.006)  # in log
_FINE_LAG = (0.005, 0.0025, 0.00125)  # s
_SMALLEST = 0.02  # s: shorter is a delay of the drive, left to the diagnosis


class Clock(SetupCheck):
    """Clock of the recorder, where no speeds were recorded, which would show it."""

    name = "clock"
    kind = "clock"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Seconds that last a quarter to four times as long."""
        if not fit.samples.clocked:
            for clock in _CLOCKS:
                yield Alternative(replace(setup, clock=setup.clock * clock))

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The clock that explains most."""

        def moved(setup: Setup, step: float) -> Setup:
            return replace(setup, clock=setup.clock * float(np.exp(step)))

        setup, loss = descended(fit, found.setup, _FINE_CLOCK, moved)
        # Accelerations that are all noise ask for ever longer seconds: then there is no clock.
        if all(fit(moved(setup, way * _FINE_CLOCK[0])).loss > loss for way in (-1.0, 1.0)):
            yield Alternative(setup)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How long a second is."""
        ratio = after.clock / before.clock
        return (
            "time and gravity contradict each other: the torques fit the motion where a recorded "
            f"second lasts {ratio:.3g} s"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """True seconds in one of the stamps."""
        clock = spec.measurement.clock * after.clock / before.clock
        return {"measurement.clock": float(f"{clock:.3g}")}


class TorqueLag(SetupCheck):
    """Torques behind the positions."""

    name = "delay of torques"
    kind = "torque_lag"
    effect = "torque_delay"
    of_all = True

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Up to a tenth of a second, both ways."""
        for lag in LAGS:
            if abs(lag - setup.lag) > _SMALLEST:
                yield Alternative(replace(setup, lag=float(lag)))

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The lag that explains most beside friction that is late itself, if any does."""

        def moved(setup: Setup, step: float) -> Setup:
            return replace(setup, lag=setup.lag + step)

        beside = fit.with_late_friction
        losses = {lag: beside(replace(found.setup, lag=lag)).loss for lag in map(float, LAGS)}
        nearest = replace(found.setup, lag=min(losses, key=losses.__getitem__))
        setup, loss = descended(beside, nearest, _FINE_LAG, moved)
        if abs(setup.lag) >= _SMALLEST and loss < beside(replace(setup, lag=0.0)).loss - CLEAR:
            yield Alternative(setup)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How late."""
        late = after.lag - before.lag
        word = "behind" if late > 0 else "before"
        return f"torques are {1e3 * abs(late):.3g} ms {word} the positions"

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """By how much torques are late."""
        late = spec.measurement.torque_lag + after.lag - before.lag
        return {"measurement.torque_lag": round(late, 5)}
