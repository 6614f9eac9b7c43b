"""The score board as Markdown: a short table, and everything by log and joint."""

from collections.abc import Callable, Sequence
from math import isfinite

import numpy as np

from benchmarks.pages import MarkedPart, percent, table
from benchmarks.peers.tools import BODIES, EXCITE, FIGAROH, SYSID, TOLD, URDF, WLS, Entry, Result

PART = MarkedPart("scoreboard", "benchmarks.scoreboard")
TOOLS = (EXCITE, BODIES, FIGAROH, TOLD, SYSID, WLS, URDF)
_SHORT = (EXCITE, FIGAROH, SYSID, WLS, URDF)
# Names in the tables, where the record has another.
_SHOWN = {BODIES: "excite, physically consistent", TOLD: "FIGAROH, coupling declared"}


def short_table(entries: Sequence[Entry]) -> str:
    """Mean held-out errors: a row for each real log and one for all simulated robots.

    The least of a row is bold. Of simulated robots: the median over those that all tools answered.
    """
    rows = [_with_told(each) for each in entries if each.real]
    common = answered([each for each in entries if not each.real])
    if common:
        medians = [float(np.median([mean(each.of(tool)) for each in common])) for tool in _SHORT]
        rows.append(row(f"{len(common)} simulated robots, median", medians))
    return table(["held-out error of the torque", *_SHORT], rows)


def _with_told(entry: Entry) -> list[str]:
    """A row of a real log; beside FIGAROH's error that with what its authors know of the robot."""
    cells = row(entry.words, [mean(entry.of(tool)) for tool in _SHORT])
    if entry.of(TOLD) is not None:
        error = percent(mean(entry.of(TOLD)))
        cells[1 + _SHORT.index(FIGAROH)] += f" ({error} with coupling declared)"
    return cells


def answered(entries: Sequence[Entry]) -> list[Entry]:
    """Those that every tool of the short table answered."""
    return [each for each in entries if all(isfinite(mean(each.of(t))) for t in _SHORT)]


def page_part(entries: Sequence[Entry], setting: str) -> str:
    """All figures of the page, between its marks."""
    parts = [setting, short_table(entries)]
    real = [each for each in entries if each.real]
    parts += [f"## {each.words}\n\n{by_joint(each)}" for each in real]
    others = [each for each in entries if not each.real]
    if others:
        parts.append(f"## Simulated robots\n\n{simulated(others)}\n\n{names(others)}")
    return "\n\n".join(parts)


def by_joint(entry: Entry) -> str:
    """Of one log: all tools, joint by joint, and what each costs."""
    some = next(each.verdict for each in entry.results if each.verdict is not None)
    joints = list(some.by_joint)
    costs = ["CPU time [s]", "lines", "date"]
    heads = ["", "mean", *joints, "as recorded", "links consistent", *costs]
    rows = []
    for tool in TOOLS:
        result = entry.of(tool)
        if result is None:
            continue
        cost = [f"{result.processor:.0f}", str(result.lines), entry.dates.get(tool, "")]
        if result.verdict is None:
            rows.append([shown(tool), f"none: {result.told}", *[""] * (len(joints) + 2), *cost])
            continue
        errors = [percent(result.verdict.by_joint[j]) for j in joints]
        whole = percent(result.verdict.mean)
        raw = percent(result.verdict.raw)
        rows.append([shown(tool), whole, *errors, raw, possible(result), *cost])
    return table(heads, rows)


def simulated(entries: Sequence[Entry]) -> str:
    """A row for each robot, and how often each tool is first."""
    tools = [tool for tool in TOOLS if tool != TOLD]
    rows = [row(each.words, [mean(each.of(tool)) for tool in tools]) for each in entries]
    firsts = [sum(_is_first(each, tool) for each in entries) for tool in tools]
    rows.append([f"first of {len(entries)}", *map(str, firsts)])
    consistent = [_count(entries, tool, lambda r: possible(r) == "yes") for tool in tools]
    rows.append(["links consistent", *consistent])
    seconds = [_median([each.of(tool) for each in entries]) for tool in tools]
    rows.append(["CPU time [s], median", *seconds])
    return table(["simulated robot, planted effect", *map(shown, tools)], rows)


def names(entries: Sequence[Entry]) -> str:
    """What excite named; no other tool names anything that its model does not have."""
    told = [r.names for each in entries if (r := each.of(EXCITE)) is not None and r.names]
    total = {key: sum(each.get(key, 0) for each in told) for key in ("wrong", "told", "planted")}
    robots = sum(each.get("wrong", 0) > 0 for each in told)
    return (
        f"excite names {total['told']} of {total['planted']} planted effects (friction of every "
        f"joint, and one more per robot). Wrong names: {total['wrong']}, on {robots} of "
        f"{len(told)} robots. The other tools have a fixed model and name nothing."
    )


def shown(tool: str) -> str:
    """The tool's name in tables."""
    return _SHOWN.get(tool, tool)


def mean(result: Result | None) -> float:
    """The mean error; NaN where there is none."""
    return float("nan") if result is None or result.verdict is None else result.verdict.mean


def possible(result: Result) -> str:
    """Whether its links are physically consistent; base parameters alone have no links."""
    known = None if result.verdict is None else result.verdict.possible
    return {True: "yes", False: "no", None: "–"}[known]


def row(words: str, errors: Sequence[float]) -> list[str]:
    """Errors in percent, the least of them bold."""
    least = min((each for each in errors if isfinite(each)), default=float("nan"))
    return [words, *(f"**{percent(x)}**" if x == least else percent(x) for x in errors)]


def _is_first(entry: Entry, tool: str) -> bool:
    errors = {each: mean(entry.of(each)) for each in TOOLS if isfinite(mean(entry.of(each)))}
    return tool in errors and errors[tool] == min(errors.values())


def _count(entries: Sequence[Entry], tool: str, good: Callable[[Result], bool]) -> str:
    found = [r for each in entries if (r := each.of(tool)) is not None]
    if all(possible(each) == "–" for each in found):
        return "–"
    return f"{sum(map(good, found))} of {len(found)}"


def _median(results: Sequence[Result | None]) -> str:
    known = [each.processor for each in results if each is not None]
    return f"{np.median(known):.0f}" if known else "–"
