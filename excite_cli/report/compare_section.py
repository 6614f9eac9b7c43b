"""Several results side by side: condition numbers, worst margins, what their configs differ in."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.campaign import RebuiltResult, in_figures
from excite_cli.report.chart import Colour
from excite_cli.report.page import Block, Charts, PageSection, TableBlock, Text
from excite_cli.report.plot import Curve, Panel, Plot

# Which keys of several configs differ, with their values.

_LONGEST = 80


def differences(names: Sequence[str], configs: Sequence[str]) -> Block:
    """A table of the keys (`constraints.torque.scale`) that are not the same in all `configs`.

    Parameters
    ----------
    names
        What each config belongs to, for the columns.
    configs
        Resolved problems as YAML text.

    Raises
    ------
    ConfigError
        A text is no config.
    """
    flat = [
        flattened(parse_spec(text, f"the config of {name}").model_dump(mode="json"))
        for name, text in zip(names, configs, strict=True)
    ]
    keys = dict.fromkeys(key for values in flat for key in values)
    rows = [(key, *(_said(values, key) for values in flat)) for key in keys]
    differing = tuple(row for row in rows if len(set(row[1:])) > 1)
    if not differing:
        return Text("The configs are the same, key by key.")
    return TableBlock(("key", *names), differing, title="What differs in the configs")


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


def compare_results(campaigns: Sequence[RebuiltResult]) -> PageSection:
    """Condition numbers, worst margins and the differing keys of several result files."""
    names = [campaign.name for campaign in campaigns]
    configs = [campaign.result.config for campaign in campaigns]
    tables: tuple[Block, ...] = (
        _numbers(campaigns),
        _margins(campaigns),
        differences(names, configs),
    )
    if not comparable(campaigns):
        return PageSection(
            "compare", "Results side by side", (Text(_NOT_COMPARABLE, "bad"), *tables)
        )
    best = min(campaigns, key=_reached)
    lead = "; ".join(f"{c.name}: {in_figures(_reached(c))} after {c.motions}" for c in campaigns)
    blocks: tuple[Block, ...] = (Charts((_chart(campaigns),)), *tables)
    lead = f"{lead}. Lowest: {best.name}."
    return PageSection("compare", "Results side by side", blocks, lead)


def comparable(campaigns: Sequence[RebuiltResult]) -> bool:
    """Whether condition numbers are about the same columns in the same scale."""
    results = [campaign.result for campaign in campaigns]
    return all(
        first.fingerprint == other.fingerprint
        and first.base_words == other.base_words
        and np.array_equal(first.row_weights, other.row_weights)
        and np.array_equal(first.column_scales, other.column_scales)
        for first, other in pairwise(results)
    )


def _reached(campaign: RebuiltResult) -> float:
    return campaign.result.motions[-1].stacked_condition_number


def _chart(campaigns: Sequence[RebuiltResult]) -> Plot:
    """Stacked condition numbers by the number of motions; a file goes on where its prior ends."""
    offsets = [_before(campaign, campaigns) for campaign in campaigns]
    lines = [
        [motion.stacked_condition_number for motion in campaign.result.motions]
        for campaign in campaigns
    ]
    count = max(offset + len(line) for offset, line in zip(offsets, lines, strict=True))
    series = []
    for number, (campaign, offset, line) in enumerate(zip(campaigns, offsets, lines, strict=True)):
        y = np.full(count, np.nan)
        y[offset : offset + len(line)] = np.where(np.isfinite(line), line, np.nan)
        series.append(Curve(_cut(campaign.name), y, _COLOURS[number % len(_COLOURS)], "joined"))
    said = "; ".join(
        f"{campaign.name}: {', '.join(map(in_figures, line))}"
        for campaign, line in zip(campaigns, lines, strict=True)
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


def _before(campaign: RebuiltResult, campaigns: Sequence[RebuiltResult]) -> int:
    """How many motions of other files on the page a file was made on top of."""
    earlier = {Path(prior).stem for prior in campaign.result.priors}
    return sum(
        len(other.result.motions)
        for other in campaigns
        if other is not campaign and Path(other.name).name in earlier
    )


def _cut(name: str, longest: int = 22) -> str:
    return name if len(name) <= longest else f"{name[: longest - 1]}…"


def _numbers(campaigns: Sequence[RebuiltResult]) -> TableBlock:
    rows = []
    for campaign in campaigns:
        result = campaign.result
        random = in_figures(result.random[-1].stacked_condition_number) if result.random else "–"
        rows.append(
            (
                campaign.name,
                str(len(result.motions)),
                " → ".join(in_figures(m.stacked_condition_number) for m in result.motions),
                random,
                ", ".join(result.priors) or "–",
                str(result.seed),
                f"{sum(m.seconds for m in result.motions):.1f}",
            )
        )
    columns = ("file", "motions", "stacked", "random", "on top of", "seed", "time [s]")
    return TableBlock(columns, tuple(rows), "Condition numbers", frozenset({1, 3, 5, 6}))


def _margins(campaigns: Sequence[RebuiltResult]) -> TableBlock:
    """The worst margin of every kind over all motions of each file."""
    kinds = dict.fromkeys(c.name for campaign in campaigns for c in campaign.problem.constraints)
    rows = tuple((kind, *(_worst(campaign, kind) for campaign in campaigns)) for kind in kinds)
    names = tuple(campaign.name for campaign in campaigns)
    right = frozenset(range(1, len(names) + 1))
    return TableBlock(("constraint", *names), rows, "Worst margins, at 1 kHz", right)


def _worst(campaign: RebuiltResult, kind: str) -> str:
    found = [m.margins[kind] for m in campaign.result.motions if kind in m.margins]
    if not found:
        return "–"
    worst = min(found, key=lambda each: each.share)
    return f"{in_figures(worst.margin)} {worst.unit}"


# Several fits, or several diagnoses, side by side: errors, what was found, what differs.


def compare_fits(fits: Mapping[str, StoredFit]) -> PageSection:
    """Errors of several fits on held-out data, what the data fix, and the differing keys."""
    rows = tuple(
        (
            name,
            stored.held_out_run,
            _percent(stored.training_error.mean_relative_moving),
            _percent(stored.error.mean_relative_moving),
            f"{int(np.sum(stored.fit.identifiable))} of {len(stored.fit.names)}",
        )
        for name, stored in fits.items()
    )
    table = TableBlock(
        ("file", "held-out run", "training error", "held-out error", "identifiable"),
        rows,
        title="Mean relative error of the torque where joints move",
        right=frozenset({2, 3, 4}),
    )
    configs = [stored.config for stored in fits.values()]
    blocks: tuple[Block, ...] = (table, differences(list(fits), configs))
    return PageSection("compare-fits", "Fits side by side", blocks)


def compare_diagnoses(diagnoses: Mapping[str, Diagnosis]) -> PageSection:
    """What several diagnoses found, their errors on held-out data and the differing keys."""
    rows = tuple(
        (
            name,
            diagnosis.held_out_run,
            _percent(diagnosis.before.mean_relative_moving),
            _percent(diagnosis.after.mean_relative_moving),
            "; ".join(
                f"{each.effect.kind.replace('_', ' ')} on {', '.join(each.effect.joints)}"
                for each in diagnosis.effects
            )
            or "nothing",
        )
        for name, diagnosis in diagnoses.items()
    )
    errors = TableBlock(
        ("file", "held-out run", "error before", "error after", "found"),
        rows,
        title="Mean relative error of the torque where joints move, on held-out data",
        right=frozenset({2, 3}),
    )
    blocks: list[Block] = [errors, *_by_joint(diagnoses)]
    names = list(diagnoses)
    blocks.append(differences(names, [diagnosis.config for diagnosis in diagnoses.values()]))
    return PageSection("compare-diagnoses", "Diagnoses side by side", tuple(blocks))


def _by_joint(diagnoses: Mapping[str, Diagnosis]) -> list[Block]:
    joints = dict.fromkeys(joint for each in diagnoses.values() for joint in each.joint_names)
    rows = tuple(
        (
            joint,
            *(
                f"{_of(each.before.relative_moving, joint)} → "
                f"{_of(each.after.relative_moving, joint)}"
                for each in diagnoses.values()
            ),
        )
        for joint in joints
    )
    right = frozenset(range(1, len(diagnoses) + 1))
    title = "The same joint by joint, before → after"
    return [TableBlock(("joint", *diagnoses), rows, title, right)]


def _of(errors: Mapping[str, float], joint: str) -> str:
    return _percent(errors[joint]) if joint in errors else "–"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if np.isfinite(share) else "–"
