"""The table of a comparison, as Markdown: dated, with goals, every figure from the races."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.pages import MarkedPart, table
from benchmarks.peers.motion_judge import Verdict
from benchmarks.peers.races import BLIND, CLAIMED, CLEAR, OURS, OWN, Measure, Race

FASTER = 20.0
THEIRS = (CLEAR, CLAIMED, BLIND)
# Which of our contestants is compared in which measure.
AIMING = {Measure.FIGAROH: OURS, Measure.EXCITE: OWN}
ROUND_TARGETS = (30.0, 20.0, 16.7, 12.0)


@dataclass(frozen=True)
class Entry:
    """A race and what the judge says of its best motion."""

    race: Race
    verdict: Verdict | None


@dataclass(frozen=True)
class Comparison:
    """All races of one run; `date` and `setting` are told above the table."""

    date: str
    setting: str
    entries: tuple[Entry, ...]

    @property
    def contestants(self) -> tuple[str, ...]:
        """Names in the order in which they ran first."""
        return tuple(dict.fromkeys(entry.race.contestant for entry in self.entries))

    def races(self, contestant: str) -> list[Race]:
        return [entry.race for entry in self.entries if entry.race.contestant == contestant]

    def best(self, contestant: str, measure: Measure) -> Race | None:
        """Its race with the lowest condition number; None where it found no motion at all."""
        found = [race for race in self.races(contestant) if np.isfinite(race.best(measure))]
        return min(found, key=lambda race: race.best(measure), default=None)

    def targets(self, measure: Measure) -> tuple[float, ...]:
        """Round condition numbers, and the best of FIGAROH in each of its ways."""
        bests = [race.best(measure) for name in THEIRS if (race := self.best(name, measure))]
        return tuple(sorted({*ROUND_TARGETS, *bests}, reverse=True))


def markdown(comparison: Comparison) -> str:
    """The whole table."""
    parts = [
        "# Beside other programs: the table",
        "Made by `python -m benchmarks.peers`, see [how it is kept fair](peers.md).",
        f"Measured on {comparison.date}. {comparison.setting}",
        goals(comparison),
        *(reached(comparison, measure) for measure in Measure),
        motions(comparison),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


PART = MarkedPart("peers", "benchmarks.peers")


def dated_goals(comparison: Comparison) -> str:
    """What stands between the marks of a page."""
    return f"Measured on {comparison.date}.\n\n{goals(comparison)}"


def goals(comparison: Comparison) -> str:
    """How much faster FIGAROH's own best is reached, and how low at equal time, by both columns."""
    rows = []
    for measure, aiming in AIMING.items():
        for name in THEIRS:
            theirs, ours = comparison.best(name, measure), comparison.races(aiming)
            if theirs is None or not ours:
                continue
            target = theirs.best(measure)
            slow = theirs.reached(target, measure)[1]
            quick = [race.reached(target, measure)[1] for race in ours]
            low = [race.at(theirs.processor, measure) for race in ours]
            faster = spread([slow / each for each in quick], times, low_is_worst=True)
            lower = spread([target / each for each in low], times, low_is_worst=True)
            goal = f"{name}: seconds to its best, {target:.2f}"
            rows.append([measure.words, goal, seconds(slow), spread(quick, seconds), faster,
                         f"≥ {FASTER:g} ×", passed(slow / max(quick) >= FASTER)])  # fmt: skip
            goal = f"{name}: condition number after its {theirs.processor:.0f} s"
            rows.append([measure.words, goal, number(target), spread(low, number), lower,
                         "lower", passed(max(low) < target)])  # fmt: skip
    heads = ["columns", "goal", "FIGAROH", "excite, median (worst)", "ratio", "required", ""]
    return table(heads, rows) if rows else ""


def reached(comparison: Comparison, measure: Measure) -> str:
    """Processor time to given condition numbers, median and worst over the seeds."""
    targets = comparison.targets(measure)
    rows = []
    for name in comparison.contestants:
        spent = (
            [race.reached(target, measure)[1] for race in comparison.races(name)]
            for target in targets
        )
        rows.append([name, *(spread(each, seconds) for each in spent)])
    first = f"processor time [s] to, by {measure.words} columns"
    return table([first, *map(number, targets)], rows)


def motions(comparison: Comparison) -> str:
    """What every race ended with, judged at 1 kHz."""
    heads = [
        "contestant", "seed", "by FIGAROH's columns", "by excite's columns",
        "deviation of torques", "search [s]", "wall [s]", "start-up [s]",
        "samples in collision", "least gap [mm]", "admissible at 1 kHz",
    ]  # fmt: skip
    rows = []
    for entry in comparison.entries:
        race, found = entry.race, entry.verdict
        spent = [f"{each:.1f}" for each in (race.processor, race.wall, race.before)]
        if found is None:
            values, gaps = ["none", "", ""], ["", "", _why(race)]
        else:
            values = [number(x) for x in (found.by_figaroh, found.by_excite, found.deviation)]
            gaps = [f"{found.colliding:.1%}", f"{1e3 * found.gap:.1f}", _admissible(race, found)]
        rows.append([race.contestant, str(race.seed), *values, *spent, *gaps])
    return table(heads, rows)


def _why(race: Race) -> str:
    start, says = race.words.get("start"), race.words.get("says", "no motion")
    return f"random start {start}; it {says}" if start else says


def _admissible(race: Race, verdict: Verdict) -> str:
    if verdict.broken:
        return f"no: {', '.join(verdict.broken)}"
    return "yes, proved at every instant" if race.proved else "yes"


def spread(
    values: Iterable[float], told: Callable[[float], str], low_is_worst: bool = False
) -> str:
    """Median and, in brackets, the worst; where not all are finite, how many."""
    listed = list(values)
    finite = [value for value in listed if np.isfinite(value) and value > 0]
    if not finite:
        return "never"
    worst = min(finite) if low_is_worst else max(finite)
    words = told(float(np.median(finite)))
    if len(listed) > 1:
        words += f" ({told(worst)})"
    if len(finite) < len(listed):
        words += f", {len(finite)} of {len(listed)}"
    return words


def seconds(value: float) -> str:
    return f"{value:.2f}" if value < 10 else f"{value:.0f}"


def number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "none"


def times(value: float) -> str:
    return f"{value:.1f} ×" if value < 10 else f"{value:.0f} ×"


def passed(good: bool) -> str:
    return "met" if good else "MISSED"
