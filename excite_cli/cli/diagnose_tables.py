"""A diagnosis for people (tables and sentences) and for scripts (JSON)."""

from dataclasses import asdict
from typing import Any

from rich.table import Table

from excite_cli.cli.noise_floor_words import above_the_floor, floor_cells, floor_columns
from excite_cli.diagnosis.result import Diagnosis, EffectRecord, NamedEffect, Round
from excite_cli.effects.base import Value
from excite_cli.effects.catalogue import catalogue
from excite_cli.robot.model import Robot

_SHOWN_ROUNDS = 6


def tables_of(
    found: Diagnosis, robot: Robot, experiment: dict[str, Any], verbose: bool
) -> list[Table | str]:
    """Rounds, verdicts, what is absorbed or unexplained, before and after, what to do next."""
    parts: list[Table | str] = [_data_in_words(found)]
    rounds = found.rounds if verbose else found.rounds[:_SHOWN_ROUNDS]
    parts += [_round_table(found, each) for each in rounds]
    if len(rounds) < len(found.rounds):
        parts.append(
            f"… {len(found.rounds) - len(rounds)} more rounds (--verbose shows them); the last "
            "one finds nothing more."
        )
    if found.named:
        parts.append(_effect_table(found))
    if found.approximations:
        parts.append(_approximation_table(found))
    if not found.effects:
        parts.append("Nothing is missing: no effect of the catalogue passes.")
    parts += _absorbed(found) + _unexplained(found)
    parts.append(_error_table(found, robot))
    parts += above_the_floor(found.after, found.noise_floor)
    parts.append(_verdict(found))
    parts.append(_next(experiment))
    return parts


def _place(record: EffectRecord, everything: int) -> str:
    whole = len(record.joints) == everything > 2
    where = "all joints" if whole else ", ".join(record.joints)
    return f"{where} ({', '.join(record.runs)})" if record.runs else where


def _title(kind: str) -> str:
    known = catalogue().get(kind)
    return known.title if known else kind


def _data_in_words(found: Diagnosis) -> str:
    p = found.processing
    cut = p.get("position_cutoff")
    standing = max(p.get("standstill_share", [0.0]), default=0.0)
    return (
        f"{p['samples']} samples at {p['rate']:.3g} Hz; positions cut off at "
        f"{'no frequency' if cut is None else f'{cut:.3g} Hz'}; joints stand still in up to "
        f"{standing:.0%} of the samples, which are left out. {p['candidates']} candidates; sealed: "
        f"{found.sealed_run}. Placebos exceed χ² by {p['inflation']:.2f}; tests allow for it."
    )


def _round_table(found: Diagnosis, each: Round) -> Table:
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    table = Table(
        title=f"Round {each.index}: residual up to {each.residual[worst]:.3g} ({worst}); "
        f"{each.verdict}",
        title_justify="left",
    )
    for name in ("suspect", "where", "p", "of the residual", "gain left out", "verdict"):
        right = name in ("p", "of the residual", "gain left out")
        table.add_column(name, justify="right" if right else "left")
    for suspect in each.suspects:
        table.add_row(
            _title(suspect.effect.kind),
            _place(suspect.effect, len(found.joint_names)),
            _p(suspect.p_value),
            f"{suspect.share_of_residual:.1%}",
            f"{suspect.gain:.1%}",
            suspect.verdict,
            style="bold" if suspect.verdict == "accepted" else None,
        )
    return table


def _p(p: float) -> str:
    return "< 1e-16" if p < 1e-16 else f"{p:.1e}" if p < 1e-3 else f"{p:.2g}"


def _effect_table(found: Diagnosis) -> Table:
    table = Table(title="What the declared model lacks", title_justify="left")
    for name in ("effect", "where", "size", "p", "share", "cannot be told from"):
        table.add_column(name, justify="right" if name in ("p", "share") else "left")
    for named in found.named:
        table.add_row(
            _title(named.effect.kind),
            _place(named.effect, len(found.joint_names)),
            "\n".join(_value(name, value) for name, value in named.parameters.items()),
            _p(named.p_value),
            f"{named.share_of_residual:.2%}",
            "\n".join(
                f"{_title(alias.kind)} on {_place(alias, len(found.joint_names))}"
                for alias in named.aliases
            )
            or "-",
        )
    return table


def _approximation_table(found: Diagnosis) -> Table:
    table = Table(
        title="Approximations: they lower the error, but something else is there",
        title_justify="left",
    )
    for name in ("effect", "where", "size", "share", "stands for"):
        table.add_column(name, justify="right" if name == "share" else "left")
    for each in found.approximations:
        table.add_row(
            _title(each.effect.kind),
            _place(each.effect, len(found.joint_names)),
            "\n".join(_value(name, value) for name, value in each.parameters.items()),
            f"{each.share_of_residual:.2%}",
            each.approximates.replace("[", r"\["),
        )
    return table


def _value(name: str, value: Value) -> str:
    unit = "" if value.unit == "1" else f" {value.unit}"
    if value.std != value.std:  # chosen from a grid
        return f"{name} {value.value:.3g}{unit}"
    return f"{name} {value.value:.4g} ± {2 * value.std:.2g}{unit}"


def _absorbed(found: Diagnosis) -> list[Table | str]:
    if not found.absorbed:
        return []
    table = Table(
        title="Not testable: these would show as other values of parameters", title_justify="left"
    )
    for name in ("effect", "where", "absorbed by"):
        table.add_column(name)
    for each in found.absorbed:
        where = ", ".join(each.joints) if len(each.joints) < 3 else "all joints"
        table.add_row(_title(each.kind), where, ", ".join(each.by).replace("[", r"\["))
    return [table]


def _unexplained(found: Diagnosis) -> list[Table | str]:
    return [
        f"Unexplained: the residual of {each.joint} still depends on "
        f"{', '.join(each.depends_on)} ({each.share_of_residual:.1%} of it); no effect of the "
        "catalogue has this form."
        for each in found.unexplained
    ]


def _error_table(found: Diagnosis, robot: Robot) -> Table:
    table = Table(
        title=f"Error of the torque on data never used ({found.sealed_run})", title_justify="left"
    )
    names = ("joint", "before", "after", "moving, before", "moving, after", "RMS before",
             "RMS after", *floor_columns(found.noise_floor), "unit")  # fmt: skip
    for name in names:
        table.add_column(name, justify="left" if name in ("joint", "unit") else "right")
    before, after = found.before, found.after
    for joint, sliding in zip(robot.joint_names, robot.sliding, strict=True):
        table.add_row(
            joint,
            f"{before.relative[joint]:.2%}",
            f"{after.relative[joint]:.2%}",
            f"{before.relative_moving[joint]:.2%}",
            f"{after.relative_moving[joint]:.2%}",
            f"{before.rms[joint]:.4g}",
            f"{after.rms[joint]:.4g}",
            *floor_cells(found.noise_floor, joint),
            "N" if sliding else "N·m",
        )
    table.add_section()
    table.add_row(
        "mean",
        f"{before.mean_relative:.2%}",
        f"{after.mean_relative:.2%}",
        f"{before.mean_relative_moving:.2%}",
        f"{after.mean_relative_moving:.2%}",
        *[""] * (len(names) - 5),
        style="bold",
    )  # fmt: skip
    return table


def _verdict(found: Diagnosis) -> str:
    low, high = found.after.interval
    return (
        f"{_counted(len(found.named), 'effect')}"
        + (f", {_counted(len(found.approximations), 'approximation')}" * bool(found.approximations))
        + "; mean error "
        f"{found.before.mean_relative_moving:.2%} → "
        f"{found.after.mean_relative_moving:.2%} where joints move (over all samples "
        f"{found.after.mean_relative:.2%}, 95 % interval {low:.2%} to {high:.2%}). "
        f"{found.seconds:.1f} s."
    )


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _next(experiment: dict[str, Any]) -> str:
    if experiment["purpose"] == "separate":
        count = len(experiment["pairs"])
        return (
            f"Next motion: tell apart {count} pair{'s' if count > 1 else ''} of effects:  "
            f"{experiment['command']}"
        )
    return f"Next motion: excite the extended model:  {experiment['command']}"


def _record(record: EffectRecord) -> dict[str, Any]:
    found: dict[str, Any] = {"kind": record.kind, "joints": list(record.joints)}
    if record.shape:
        found["shape"] = dict(record.shape)
    if record.runs:
        found["runs"] = list(record.runs)
    return found


def _named(named: NamedEffect, runs: list[str]) -> dict[str, Any]:
    return {
        "kind": named.effect.kind,
        "joints": list(named.effect.joints),
        "parameters": {name: asdict(value) for name, value in named.parameters.items()},
        "p_value": named.p_value,
        "share_of_residual": named.share_of_residual,
        "gain": named.gain,
        "alias_set": [_record(alias) for alias in named.aliases],
        "runs": list(named.effect.runs) or runs,
    }


def answer_of(found: Diagnosis, experiment: dict[str, Any]) -> dict[str, Any]:
    """The answer for `--json`."""
    runs = [str(name) for name in found.processing.get("runs", [])]
    return {
        "declared_effects": [_record(record) for record in found.declared],
        "effects": [_named(each, runs) for each in found.named],
        "approximations": [
            {**_named(each, runs), "stands_for": each.approximates} for each in found.approximations
        ],
        "absorbed": [
            {"kind": a.kind, "joints": list(a.joints), "by": list(a.by), "left": a.left}
            for a in found.absorbed
        ],
        "unexplained": [asdict(each) for each in found.unexplained],
        "error": {
            "sealed_run": found.sealed_run,
            "before": found.before.as_data(),
            "after": found.after.as_data(),
        },
        "noise_floor": found.noise_floor,
        "next_experiment": experiment,
        "findings": [asdict(finding) for finding in found.findings],
        "processing": found.processing,
        "rounds": [asdict(each) for each in found.rounds],
        "seconds": found.seconds,
    }
