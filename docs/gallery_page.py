"""What the gallery says of one real robot, as Markdown: from its log to what stays unexplained."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import approximation_in_words, ends_in_words, rests_in_words
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.answer import Command, Detail, Part, Table
from excite_cli.summary.error_by_joint import error_tables
from excite_cli.summary.named_effects import (
    absorbed_parts,
    approximation_parts,
    effect_parts,
    friction_table,
)

HEAD = "---\nhide: [toc]\n---\n\n<!-- Made by `python -m docs.make_gallery`; edit nothing here. -->"
# Figures of the first answer, and of the others; torque in time has one for each held-out run.
IN_FULL = ("before_", "friction", "effects_1", "errors", "after_")
OTHERWISE = ("effects_1", "errors")
_SOURCES = ("source", "licence", "torque", "note", "rate_note", "changes")  # attributes of a log
_ENDING = re.compile(r" \(--verbose[^)]*\)")


@dataclass(frozen=True)
class Diagnosed:
    """A log as it was diagnosed: in `words`, by `command`; `pictures` are files by figure.

    `told`: what was found, beside what is published, as in the table of real robots.
    """

    words: str
    command: Command
    found: Diagnosis
    told: str
    pictures: Mapping[str, str]


def page(facts: Mapping[str, str], data: Dataset, answers: Sequence[Diagnosed]) -> str:
    """The page: the first answer from beginning to end, and what the others have instead.

    `facts` are the attributes of the log's file: `robot`, `source`, `licence` and others.
    """
    first, others = answers[0], answers[1:]
    parts = [
        f"{HEAD}\n\n# {escaped(facts['robot'])}",
        *_answer(first),
        *_log(facts, data, first),
        *_residual(first),
        *_names(first),
        *_after(first),
        *_unexplained(first.found),
        *(part for each in others for part in _otherwise(each)),
    ]
    return "\n\n".join(parts) + "\n"


def _answer(each: Diagnosed) -> list[str]:
    return [
        f"**The answer.** {escaped(answer_in_words(each.found))}",
        f"**What was found, beside what is known.** {escaped(each.told)}.",
    ]


def _log(facts: Mapping[str, str], data: Dataset, first: Diagnosed) -> list[str]:
    found = first.found
    training = {str(name) for name in found.processing.get("runs", ())}
    rows = tuple(
        (
            run.name,
            f"{len(run.t)}",
            f"{run.duration:.3g}",
            f"{(len(run.t) - 1) / run.duration:.4g}",
            "held out"
            if run.name not in training
            else f"training, {found.held_out_run} held out"
            if run.name in found.held_out_run
            else "training",
        )
        for run in data.runs
    )
    columns = ("run", "samples", "duration [s]", "rate [Hz]", "used as")
    runs = Table("", columns, rows, left=("run", "used as"))
    told = [f"{each.severity}: {each.text}" for each in found.findings]
    return [
        "## The log",
        bullets(f"{name.replace('_', ' ')}: {facts[name]}" for name in _SOURCES if name in facts),
        as_markdown(runs),
        "*Held-out* data take no part in choosing or fitting; every error on this page is told on "
        "them. All of it is one command:",
        as_markdown(first.command),
        "What the program says of these data:",
        bullets(told or ["nothing"]),
    ]


def _residual(first: Diagnosed) -> list[str]:
    before = first.found.before
    return [
        "## What the declared model leaves",
        "The config declares no effect: the declared model is the rigid bodies of the URDF (with "
        "the friction of its `<dynamics>`, if any), refitted to the training data. On the held-out "
        f"data it leaves {before.mean_relative_moving:.1%} of the torque (RMS, where joints move, "
        "mean over joints).",
        *_pictures(first, "before_", "Measured torque, the declared model, and what it leaves"),
    ]


def _names(first: Diagnosed) -> list[str]:
    found = first.found
    parts: list[Part] = [
        *(effect_parts(found, Detail.BRIEF) if found.named else ["No effect is named."])
    ]
    parts += approximation_parts(found, Detail.BRIEF)
    parts += [friction_table(found.friction_lines)] if found.friction_lines else []
    tables = [part for part in parts if isinstance(part, Table)]
    small = [
        part for part in parts if isinstance(part, str) and "indistinguishable from" not in part
    ]
    doubts = [part for part in parts if isinstance(part, str) and "indistinguishable from" in part]
    return [
        "## Names",
        *map(as_markdown, [*tables[:1], *small, *tables[1:]] if found.named else [*small, *tables]),
        *([f"Indistinguishable in these data:\n\n{bullets(doubts)}"] if doubts else []),
        *_pictures(first, "friction", "All friction of each joint over its speed"),
        *_pictures(first, "effects_1", "Evidence of the largest effects, one by one"),
    ]


def _after(first: Diagnosed) -> list[str]:
    found = first.found
    return [
        "## Before and after",
        as_markdown(_errors(found)),
        *_pictures(first, "errors", "Errors of every joint before and after"),
        *map(escaped, map(ends_in_words, found.parts)),
        *_pictures(first, "after_", "Measured torque, the model with what was found, the residual"),
    ]


def _errors(found: Diagnosis) -> Table:
    """The table of errors, without the words on who took them off: a page is narrow."""
    (table,) = error_tables(found, Detail.BRIEF)
    kept = [k for k, name in enumerate(table.columns) if name not in table.words]
    columns, *rows = (tuple(row[k] for k in kept) for row in (table.columns, *table.rows))
    return replace(table, columns=columns, rows=tuple(rows), words=())


def _unexplained(found: Diagnosis) -> list[str]:
    """What is left of every joint, and what these data cannot test."""
    return [
        "## Unexplained residual",
        bullets(f"**{escaped(joint)}**: {escaped(text)}" for joint, text in left_of(found).items()),
        *map(as_markdown, absorbed_parts(found)),
    ]


def left_of(found: Diagnosis) -> dict[str, str]:
    """By joint: its error on held-out data, and what is said of the rest of its torque."""
    said = {}
    for joint in found.joint_names:
        only = replace(
            found,
            excess_residuals=tuple(each for each in found.excess_residuals if each.joint == joint),
        )
        rests = [text for texts in rests_in_words(only) for text in texts]
        stands: dict[str, list[str]] = {}
        for each in found.approximations:
            if joint in each.effect.joints and each.approximates:
                what = approximation_in_words(each.approximates)
                stands.setdefault(what, []).append(each.effect.kind)
        near = [f"Only approximated, by {', '.join(k)}: {what}." for what, k in stands.items()]
        words = " ".join([*rests, *near]) or (
            "No structure, and no more than noise, was found in what is left of the training data."
        )
        share = found.after.relative_moving[joint]
        moving = f"{share:.1%} of its torque is left where it moves" if share == share else (
            "it does not move in the held-out data, or has no torque"
        )  # fmt: skip
        said[joint] = f"{moving}. {words}"
    return said


def _otherwise(each: Diagnosed) -> list[str]:
    """The same log asked in another way: the answer, the names, the errors."""
    found = each.found
    return [
        f"## {escaped(each.words[:1].upper() + each.words[1:])}",
        as_markdown(each.command),
        *_answer(each),
        *(map(as_markdown, effect_parts(found, Detail.BRIEF)[:1]) if found.named else ()),
        *_pictures(each, "effects_1", "Evidence of the largest effects, one by one"),
        as_markdown(_errors(found)),
        *_pictures(each, "errors", "Errors of every joint before and after"),
    ]


def _pictures(each: Diagnosed, figure: str, words: str) -> list[str]:
    """Pictures of a figure; of torque in time there is one for each run with held-out data."""
    names = [name for name in each.pictures if name.startswith(figure)]
    return [f"![{words}]({each.pictures[name]})" for name in names]


def as_markdown(part: Part) -> str:
    """A table, a sentence, or a command as Markdown."""
    if isinstance(part, Command):
        why = "half a minute each; the pages have a test of their own"
        return f"<!-- not run: {why} -->\n```console\n$ {part.line}\n```"
    if isinstance(part, str):
        return escaped(_ENDING.sub("", part))
    sides = [":--" if name in part.left or name in part.words else "--:" for name in part.columns]
    lines = [part.columns, sides, *part.rows]
    table = "\n".join(
        "| " + " | ".join(escaped(cell).replace("\n", "<br>") for cell in row) + " |"
        for row in lines
    )
    return f"{escaped(part.title)}:\n\n{table}" if part.title else table


def bullets(texts: Iterable[str]) -> str:
    """A list; the texts are Markdown already where they are emphasised, and escaped otherwise."""
    return "\n".join(f"- {text if text.startswith('**') else escaped(text)}" for text in texts)


def escaped(text: str) -> str:
    """Safe for Markdown: tags, links, columns of tables and emphasis."""
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([|\[\]*`])", r"\\\1", text)
