"""Several results side by side: condition numbers, worst margins, what their configs differ in."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import counted
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.chart import Colour, in_figures
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.shown.answer import Block, Charts, Section, Table, Text
from excite_cli.summary.cells import percent
from excite_cli.summary.motions import margin_table
from excite_cli.summary.named_effects import what_and_where

# Which keys of several configs differ, with their values.

_LONGEST = 80


def differences(configs: Mapping[str, str]) -> Block:
    """A table of the keys (`constraints.torque.scale`) that are not the same in all `configs`.

    `configs` are resolved problems as YAML text, by what each belongs to, for the columns.

    Raises
    ------
    ConfigError
        A text is no config.
    """
    flat = [
        flattened(parse_spec(text, f"the config of {name}").model_dump(mode="json"))
        for name, text in configs.items()
    ]
    keys = dict.fromkeys(key for values in flat for key in values)
    rows = [(key, *(_said(values, key) for values in flat)) for key in keys]
    differing = tuple(row for row in rows if len(set(row[1:])) > 1)
    if not differing:
        return "The configs are the same, key by key."
    columns = ("key", *configs)
    return Table("What differs in the configs", columns, differing, left=columns)


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Leaves of nested mappings by their dotted paths; lists count as leaves."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping) and value:
            found |= flattened(value, f"{path}.")
        else:
            found[path] = value
    return found


def _said(values: Mapping[str, Any], key: str) -> str:
    if key not in values:
        return "–"
    text = json.dumps(values[key], ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


_NOT_COMPARABLE = (
    "These files differ in robot, moved joints, rows, effects or weights: their condition numbers "
    "are about different parameters, or in different units, and do not compare."
)
_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple")
_HEIGHT = 200  # px


def compare_results(results: Mapping[str, Result]) -> Section:
    """Condition numbers, worst margins and the differing keys of several result files."""
    blocks: list[Block] = [_numbers(results), _margins(results)]
    blocks.append(differences({name: result.config for name, result in results.items()}))
    lead = ""
    if comparable(list(results.values())):
        reached = {n: each.motions[-1].stacked_condition_number for n, each in results.items()}
        told = (
            f"{name}: {in_figures(reached[name])} after {counted(len(each.motions), 'motion')}"
            for name, each in results.items()
        )
        lead = f"{'; '.join(told)}. Lowest: {min(reached, key=lambda name: reached[name])}."
        blocks.insert(0, Charts((_chart(results),)))
    else:
        blocks.insert(0, Text(_NOT_COMPARABLE, "bad"))
    return Section("compare", "Results side by side", tuple(blocks), lead)


def comparable(results: Sequence[Result]) -> bool:
    """Whether condition numbers are about the same columns in the same scale."""
    return all(
        first.fingerprint == other.fingerprint
        and first.base_words == other.base_words
        and np.array_equal(first.row_weights, other.row_weights)
        and np.array_equal(first.column_scales, other.column_scales)
        for first, other in pairwise(results)
    )


def _chart(results: Mapping[str, Result]) -> Plot:
    """Stacked condition numbers by the number of motions; a file goes on where its prior ends."""
    offsets = [_before(result, results) for result in results.values()]
    lines = [
        [motion.stacked_condition_number for motion in result.motions]
        for result in results.values()
    ]
    count = max(offset + len(line) for offset, line in zip(offsets, lines, strict=True))
    series = []
    for number, (name, offset, line) in enumerate(zip(results, offsets, lines, strict=True)):
        y = np.full(count, np.nan)
        y[offset : offset + len(line)] = np.where(np.isfinite(line), line, np.nan)
        series.append(Curve(_cut(name), y, _COLOURS[number % len(_COLOURS)], "joined"))
    said = "; ".join(
        f"{name}: {', '.join(map(in_figures, line))}"
        for name, line in zip(results, lines, strict=True)
    )
    axis = "stacked condition number [–]"
    return Plot(
        "Stacked condition numbers",
        f"{said}.",
        "motions so far [–]",
        np.arange(1.0, count + 1),
        (Panel(axis, tuple(series), height=_HEIGHT, logarithmic=True),),
        span=(0.5, count + 0.5),
        counted=True,
    )


def _before(result: Result, results: Mapping[str, Result]) -> int:
    """How many motions of other files on the page a file was made on top of."""
    earlier = {Path(prior).stem for prior in result.priors}
    return sum(
        len(other.motions)
        for name, other in results.items()
        if other is not result and Path(name).name in earlier
    )


def _cut(name: str, longest: int = 22) -> str:
    return name if len(name) <= longest else f"{name[: longest - 1]}…"


def _numbers(results: Mapping[str, Result]) -> Table:
    rows = (
        {
            "file": name,
            "motions": str(len(result.motions)),
            "stacked": " → ".join(in_figures(m.stacked_condition_number) for m in result.motions),
            "random": " ".join(in_figures(m.stacked_condition_number) for m in result.random[-1:]),
            "on top of": ", ".join(result.priors),
            "seed": str(result.seed),
            "planning [s]": f"{sum(m.seconds for m in result.motions):.1f}",
        }
        for name, result in results.items()
    )
    return Table.of("Condition numbers", rows, left=("file", "stacked", "on top of"))


def _margins(results: Mapping[str, Result]) -> Table:
    """The worst margin of every kind over all motions of each file."""
    every = {
        name: {row[0]: f"{row[1]} {row[2]}" for row in margin_table(result.motions).rows}
        for name, result in results.items()
    }
    kinds = dict.fromkeys(kind for worst in every.values() for kind in worst)
    rows = tuple((kind, *(worst.get(kind, "–") for worst in every.values())) for kind in kinds)
    return Table("Worst margins, sampled at 1 kHz", ("constraint", *every), rows, ("constraint",))


# Several fits, or several diagnoses, side by side: errors, what was found, what differs.

_MEAN_ERROR = "Mean relative error of the torque where joints move"


def compare_fits(fits: Mapping[str, StoredFit]) -> Section:
    """Errors of several fits on held-out data, what the data fix, and the differing keys."""
    rows = (
        {
            "file": name,
            "held-out run": stored.held_out_run,
            "training error": percent(stored.training_error.mean_relative_moving),
            "held-out error": percent(stored.error.mean_relative_moving),
            "identifiable": f"{int(np.sum(stored.fit.identifiable))} of {len(stored.fit.names)}",
        }
        for name, stored in fits.items()
    )
    table = Table.of(_MEAN_ERROR, rows, left=("file", "held-out run"))
    blocks = (table, differences({name: stored.config for name, stored in fits.items()}))
    return Section("compare-fits", "Fits side by side", blocks)


def compare_diagnoses(diagnoses: Mapping[str, Diagnosis]) -> Section:
    """What several diagnoses found, their errors on held-out data and the differing keys."""
    rows = []
    for name, found in diagnoses.items():
        effects = [what_and_where(each.effect, len(found.joint_names)) for each in found.effects]
        row = {
            "file": name,
            "held-out run": found.held_out_run,
            "declared": percent(found.before.mean_relative_moving),
            "with effects": percent(found.after.mean_relative_moving),
            "found": "; ".join(effects) or "nothing",
        }
        rows.append(row)
    title = f"{_MEAN_ERROR}, on held-out data"
    joints = dict.fromkeys(joint for each in diagnoses.values() for joint in each.joint_names)
    by_joint = (
        {"joint": joint, **{name: _change(found, joint) for name, found in diagnoses.items()}}
        for joint in joints
    )
    beside = "The same joint by joint, declared → with effects"
    blocks = (
        Table.of(title, rows, left=("file", "held-out run"), words=("found",)),
        Table.of(beside, by_joint, left=("joint",)),
        differences({name: found.config for name, found in diagnoses.items()}),
    )
    return Section("compare-diagnoses", "Diagnoses side by side", blocks)


def _change(found: Diagnosis, joint: str) -> str:
    errors = (each.relative_moving.get(joint, np.nan) for each in (found.before, found.after))
    return " → ".join(map(percent, errors))
