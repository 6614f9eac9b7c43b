"""What was seen of log and model before any physics, check by check."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from excite_cli.checks.check_result import CheckResult
from excite_cli.checks.sentences import written
from excite_cli.diagnosis.power import EffectPower
from excite_cli.fields import data_of
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.shown.answer import (
    Answer,
    Command,
    KeyFigure,
    Page,
    Part,
    Parts,
    Section,
    Shown,
    Table,
    Text,
    as_word,
    show,
)
from excite_cli.summary.weakest import power_data, power_table

# Measured data in words, and their runs as a table.


def runs_in_words(data: Dataset) -> str:
    """`2 runs, 24 s`."""
    runs = "1 run" if len(data.runs) == 1 else f"{len(data.runs)} runs"
    return f"{runs}, {sum(run.duration for run in data.runs):.3g} s"


def dataset_parts(data: Dataset) -> Parts:
    """The runs, and what was noticed."""
    noticed = dict.fromkeys(f"{each.severity}: {each.text}" for each in data.findings)
    return [_run_table(f"Runs of {', '.join(data.joint_names)}", data.runs), *noticed]


def _run_table(title: str, runs: Sequence[Run]) -> Table:
    """Also where each came from, if they were read from files."""
    read = any(run.origin.file for run in runs)
    rows = (
        {
            "run": run.label,
            "samples": str(len(run.t)),
            "seconds": f"{run.duration:.2f}",
            "rate [Hz]": f"{1.0 / run.step:.4g}",
            "usable": f"{run.usable().mean():.1%}",
            **({"from": f"{run.origin.file} {run.origin.place}".strip()} if read else {}),
        }
        for run in runs
    )
    return Table.of(title, rows, left=("run",), words=("from",))


def _run_in_words(run: Run) -> str:
    words = f"{run.label}: {run.q.shape[1]} joints, {len(run.t)} samples, {run.duration:.3g} s"
    return f"{words}, from {run.origin.file}" if run.origin.file else words


show(Dataset, lambda data: f"{len(data.joint_names)} joints; {runs_in_words(data)}", dataset_parts)
show(Run, _run_in_words, lambda run: [_run_table("Run", [run])])


@dataclass(frozen=True, repr=False)
class LogInspection(Shown):
    """`results` in the order of the checks; `settings`: what would change in the config.

    `power`: sizes of effects that a diagnosis would name with 95 %, if they were asked for, of
    torques with this `noise`.
    """

    results: tuple[CheckResult, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)
    runs: tuple[str, ...] = ()
    power: tuple[EffectPower, ...] = ()
    noise: str = ""

    @property
    def good(self) -> bool:
        """Whether nothing is wrong for certain."""
        return all(each.status != "fault" for each in self.results)


def inspection_answer(
    found: LogInspection,
    config: str = "",
    data: tuple[str, ...] = (),
    applied: str | None = None,
    page: str | None = None,
) -> Answer:
    """What `excite inspect` answers; status 1 with a fault."""
    parts = _parts(found, config, data, {"apply": applied, "page": page})
    return Answer((*parts,), {**_data(found, applied), "page": page}, found.good)


def inspection_parts(found: LogInspection) -> list[Part]:
    """The headline, the rows, and the evidence of what is not fine."""
    return _parts(found, "", (), {})


def checks_table(found: LogInspection) -> Table:
    """A row for every check: its status, its joints, and what settles it."""
    rows = (
        {
            "check": each.name,
            "status": each.status,
            "joints": ", ".join(each.joints),
            "key that resolves it": written(each.settings),
        }
        for each in found.results
    )
    bold = tuple(k for k, each in enumerate(found.results) if each.status != "ok")
    words = ("joints", "key that resolves it")
    return Table.of("Set-up checks", rows, left=("check", "status"), words=words, bold=bold)


def remarks(found: LogInspection) -> list[str]:
    """The evidence: of faults, then of doubts, then what was repaired."""
    texts = []
    for status, lead in (("fault", "fault: "), ("doubt", "doubt: "), ("ok", "")):
        own = [each for each in found.results if each.status == status and each.evidence]
        texts += [
            f"{lead}{_where(each) if lead else ''}{each.evidence.rstrip('.?')}"
            + ("?" if each.evidence.endswith("?") else ".")
            for each in own
        ]
    return texts


def _parts(
    found: LogInspection, config: str, data: tuple[str, ...], written_to: Mapping[str, str | None]
) -> list[Part]:
    parts: list[Part] = [headline(found), checks_table(found), *remarks(found)]
    if found.power:
        parts.append(power_table(found.power, found.noise))
    applied, page = written_to.get("apply"), written_to.get("page")
    if page is not None:
        parts.append(f"Written: {page} (page).")
    files = tuple(map(as_word, data))
    diagnose = "Next: find what the model lacks:"
    if applied is not None:
        what = (
            f"with {written(found.settings)}" if found.settings else "in which nothing is changed"
        )
        parts.append(f"Written: {applied}, {what}.")
        if files:
            parts += [diagnose, Command(("excite", "diagnose", as_word(applied), *files))]
        else:
            parts += ["Next: plan motions:", Command(("excite", "optimize", as_word(applied)))]
    elif found.settings and config:
        again = ("excite", "inspect", as_word(config), *files, "--apply", "corrected.yaml")
        parts += ["Next: write the config that says so:", Command(again)]
    elif files and found.good:
        parts += [diagnose, Command(("excite", "diagnose", as_word(config), *files))]
    elif found.good:
        parts += ["Next: plan motions:", Command(("excite", "optimize", as_word(config)))]
    else:
        parts.append("Next: see to the faults above, and inspect again.")
    return parts


def _where(result: CheckResult) -> str:
    return f"{result.runs}: " if result.runs else ""


def headline(found: LogInspection) -> str:
    """One sentence."""
    faults, doubts, count = counted(found)
    if faults:
        more = f", {doubts} to be looked at" if doubts else ""
        return f"{faults} of {count} checks found a fault{more}: correct it before any fit."
    if doubts:
        verb = "is" if doubts == 1 else "are"
        return f"No faults; {doubts} of {count} checks {verb} doubtful."
    return f"No faults and no doubts: {count} checks."


def counted(found: LogInspection) -> tuple[int, int, int]:
    """Checks with a fault, others with a doubt, all: the worse one counts where both were found."""
    faulty = {each.name for each in found.results if each.status == "fault"}
    doubted = {each.name for each in found.results if each.status == "doubt"} - faulty
    return len(faulty), len(doubted), len({each.name for each in found.results})


def _data(found: LogInspection, applied: str | None) -> dict[str, Any]:
    """The answer for `--json`."""
    own = ("name", "status", "joints", "runs", "evidence", "settings")
    return {
        "good": found.good,
        "settings": dict(found.settings),
        "output": applied,
        "checks": [
            {**data_of(each, *own), "key": written(each.settings)} for each in found.results
        ],
        **({"power": power_data(found.power)} if found.power else {}),
    }


def inspection_page(found: LogInspection, title: str) -> Page:
    """The table of all checks, the evidence of what is not fine, and what would be set."""
    faults, doubts, _ = counted(found)
    rows = tuple((key, written({key: value})) for key, value in found.settings.items())
    columns = ("key", "line that inspect --apply writes")
    cures = Table("", columns, rows, left=columns[:1], words=columns[1:])
    sections = (
        Section("checks", "Checks", (checks_table(found),)),
        Section("evidence", "Evidence", tuple(remarks(found))),
        Section("settings", "What would change in the config", (cures,) if rows else ()),
    )
    return Page(
        title,
        "Log and model: set-up checks",
        (
            KeyFigure("faults", str(faults), verdict="bad" if faults else "good"),
            KeyFigure("doubts", str(doubts), verdict="open" if doubts else "good"),
        ),
        tuple(section for section in sections if section.blocks),
        (Text(headline(found), "good" if found.good else "bad"),),
    )


show(LogInspection, headline, inspection_parts)
