"""What stands between the marks of docs/robots.md: counts by stage and outcome, a row for each."""

import statistics
from collections import Counter
from datetime import date
from pathlib import Path
from typing import Any

from benchmarks.pages import MarkedPart, table
from benchmarks.robots.sources import PACKAGES, Source
from excite_cli.effects.catalogue import catalogue

Record = dict[str, Any]
PART = MarkedPart("robots", "benchmarks.all_robots")
_COUNTS = "format, robots:, motion:, proved:, named alone:, named beside others:, not named:"
_HEADS = """robot, format, joints:, base parameters:, condition number:, pairs:, init [s]:, \
optimize [s]:, effect, named, outcome"""


def page(found: list[tuple[Source, Record]], listed: list[Source], seed: int) -> str:
    """Markdown of the records that are there, of the robots that are listed."""
    records = [record for _, record in found]
    total = Counter(record["format"] for record in records)
    counts = [
        _counted(form, [r for r in records if form in (r["format"], "all")])
        for form in (*total, "all")
    ]
    parts = [
        f"{date.today():%d %B %Y}, a two-core server, seed {seed}. {_share(found, listed)}",
        table(_COUNTS.split(", "), counts),
        _beside(records),
        _times(records),
        table(_HEADS.split(", "), [_row(source, record) for source, record in found]),
        f"Packages, of which only data files are read: {', '.join(PACKAGES)}.",
    ]
    return "\n\n".join(part for part in parts if part)


def _share(found: list[tuple[Source, Record]], listed: list[Source]) -> str:
    """How many of the robots on the list were run."""
    theirs, ours = (
        sum(each.is_example for each in some) for some in (listed, [s for s, _ in found])
    )
    return (
        f"{len(found) - ours} of the {len(listed) - theirs} robots of these packages and "
        f"{ours} of the {theirs} of example-robot-data were run."
    )


def _counted(form: str, records: list[Record]) -> list[object]:
    diagnosed = [r["diagnosis"] for r in records if "diagnosis" in r]
    return [
        form,
        len(records),
        sum("admissible" in r for r in records),
        sum("admissible" in r and r["proved"] for r in records),
        sum(d["alone"] for d in diagnosed),
        sum(d["right"] and not d["alone"] for d in diagnosed),
        sum(not d["right"] for d in diagnosed),
    ]


def _beside(records: list[Record]) -> str:
    """How many are named as the parts that they are made of, and how many get wrong names."""
    found = [(r["planted"], r["diagnosis"]) for r in records if "diagnosis" in r]
    if not found:
        return ""
    same = sum(d["alone"] and _is_the_same(plant, d["named"]) for plant, d in found)
    wrong = sum(d["wrong"] for _, d in found)
    words = f"{same} of those named alone are asymmetric friction, named as Coulomb friction and "
    words += "an offset: the same columns, as the answer reports. "
    return f"{words if same else ''}Robots with a wrong name: {wrong} of {len(found)}."


def _is_the_same(plant: dict[str, Any], named: list[str]) -> bool:
    """Whether kinds are named that together are the planted one's columns."""
    together = catalogue()[plant["kind"]].same_as
    return bool(together) and set(named) == {
        f"{kind} of {', '.join(plant['joints'])}" for kind in together
    }


def _times(records: list[Record]) -> str:
    def spent_on(verb: str) -> str:
        spent = [r["seconds"][verb] for r in records if verb in r["seconds"]]
        return f"`{verb}` {statistics.median(spent):.0f} s ({max(spent):.0f} s)" if spent else ""

    verbs = ("init", "optimize", "check", "simulate", "diagnose")
    return "Median and longest: " + ", ".join(filter(None, map(spent_on, verbs))) + "."


def _row(source: Source, record: Record) -> list[str]:
    plant, found = record.get("planted"), record.get("diagnosis")
    cells = [
        source.name + (f" (also {', '.join(source.also)})" if source.also else ""),
        *(record.get(name, "") for name in ("format", "joints", "base_parameters")),
        _figure(record.get("condition_number")),
        record.get("ignored_pairs", ""),
        *(record["seconds"].get(verb, "") for verb in ("init", "optimize")),
        "" if plant is None else _effect(plant),
        "" if found is None else "; ".join(found["named"]) or "–",
        _outcome(record),
    ]
    return [str(cell).replace("|", "/") for cell in cells]


def _effect(plant: Record) -> str:
    few = plant["joints"] if len(plant["joints"]) < plant["moved"] else ["all joints"]
    return f"{plant['kind']} of {', '.join(few)}"


def _outcome(record: Record) -> str:
    if "failed" in record:
        return f"{record['failed']}: {_sentence(record['message'])}"
    motion = "proved" if record["proved"] else "sampled in part"
    found = record["diagnosis"]
    if found["alone"]:
        return f"{motion}; named alone"
    if found["right"]:
        return f"{motion}; named beside others"
    return f"{motion}; {_sentence(found['sentence'])}"


def _sentence(message: str) -> str:
    """A message in one line, without the folders of this machine."""
    words = [Path(word).name if word.startswith("/") else word for word in message.split()]
    return " ".join(words)


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}" if value < 1000 else f"{value:.0f}"
