"""Who measures the motions of a campaign, as the options say."""

from pathlib import Path

from excite_cli.api.campaigning import Inbox, Measure, MeasureCommand, Simulated, SimulationSettings
from excite_cli.api.loading import Case
from excite_cli.api.showing import Tell, saying


def measured_by(
    case: Case,
    measure: str | None,
    inbox: Path | None,
    suffix: str,
    limit: float | None,
    effects: tuple[str, ...],
    inertia_error: float,
    tell: Tell,
) -> Measure:
    """A program, a folder for people who carry files, or a simulated robot."""
    if inbox is not None:
        return Inbox(inbox, saying(tell), suffix)
    assert measure is not None
    if measure == "simulate":
        settings = SimulationSettings(seed=case.spec.seed, inertia_error=inertia_error)
        return Simulated(case, effects, settings)
    return MeasureCommand.of(measure, suffix, limit, tell)
