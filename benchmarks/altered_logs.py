"""Altered logs: what the program says of each mistake, and whether its key brings the answer back.

    python -m benchmarks.altered_logs [--only ur10 … | 'torque in' …] [--keys] [--text]

Recordings of simulated and of real robots are altered the ways that files go wrong, and diagnosed
as a user would: exit status, what is said of the data that is not said of the unaltered file, what
is named, and the error on held-out data before and after. With `--keys` once more with the key that
settles it; `!` where a mistake is not told.

    python -m benchmarks.altered_logs --sound 56 [--seed 21]

The data of sound recordings are checked as `identify` and `diagnose` check them: how many are
refused, and of how many something is said that is not so.
"""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.altered.alterations import ALTERATIONS, Alteration
from benchmarks.altered.recordings import NAMES, Recording, recording
from benchmarks.altered.sound import TRUE, sound_logs
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import Case, load_data
from excite_cli.checks.look import check_dataset
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import ExciteError
from excite_cli.measurement.dataset import Dataset, Finding
from excite_cli.measurement.hdf5_writer import write_dataset


@dataclass(frozen=True)
class Said:
    """What a diagnosis says of a file."""

    status: int
    findings: tuple[Finding, ...]
    names: tuple[str, ...]
    before: float
    after: float

    @property
    def kinds(self) -> frozenset[str]:
        """Of findings that are more than a note."""
        return frozenset(each.kind for each in self.findings if each.severity != "note")

    def line(self, usual: frozenset[str], told: Sequence[str]) -> str:
        """`exit, what is said beside the usual, names, errors`; `!` where a mistake is not told."""
        more = sorted(self.kinds - usual)
        missed = "! " if told and not (self.kinds & set(told) or self.status == 2) else ""
        errors = f"{self.before:.1%} → {self.after:.1%}"
        names = ", ".join(self.names)
        return f"{self.status} {errors:16s} {missed}{', '.join(more) or '-'} | {names}"


def said(case: Case, data: Dataset, checks: bool, sealed: str | None = None) -> Said:
    """As `excite diagnose` does, the data from a file; or its `checks` of the data alone."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.h5"
        write_dataset(path, data, {})
        try:
            if checks:
                return Said(0, _checked(case, path, sealed), (), float("nan"), float("nan"))
            found = diagnose(case, path, sealed, tell=lambda note: None)
        except ExciteError as error:
            refused = Finding("refused", "error", str(error).replace(f"{path}: ", ""))
            return Said(2, (refused,), (), float("nan"), float("nan"))
    before, after = (e.mean_relative_moving for e in (found.before, found.after))
    status = 0 if found.good else 1
    return Said(status, found.findings, tuple(_names(found)), before, after)


def _checked(case: Case, path: Path, sealed: str | None = None) -> tuple[Finding, ...]:
    data = load_data(case, path, tell=lambda note: None)
    return (*data.findings, *check_dataset(case.robot, data, case.spec, sealed))


def _names(found: Diagnosis) -> Iterator[str]:
    for each in found.effects:
        sizes = " ".join(f"{v.value:.3g}±{v.std:.1g}" for v in each.parameters.values())
        yield f"{each.effect.kind}@{'+'.join(each.effect.joints)}({sizes})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--log", nargs="+", choices=NAMES, default=NAMES)
    parser.add_argument("--only", nargs="+", help="alterations whose names contain one of these")
    parser.add_argument(
        "--checks", action="store_true", help="of the altered data alone: no diagnosis"
    )
    parser.add_argument("--keys", action="store_true", help="again with the key that settles it")
    parser.add_argument("--text", action="store_true", help="print all that is said")
    parser.add_argument("--sound", type=int, help="check so many sound campaigns, and real logs")
    parser.add_argument("--seed", type=int, default=21, help="of the sound campaigns")
    arguments = parser.parse_args()
    if arguments.sound is not None:
        check_sound(arguments.sound, arguments.seed)
        return
    for name in arguments.log:
        of = recording(name)
        usual = said(of.case, of.data, arguments.checks)
        print(f"\n{name}: {usual.line(frozenset(), ())}", flush=True)
        for title, alteration in _chosen(of, arguments.only):
            _row(of, title, alteration, usual, arguments)


def check_sound(simulated: int, seed: int) -> None:
    """Print what is said of sound recordings, and how often that is wrong."""
    logs, refused, warned = 0, 0, 0
    for log in sound_logs(simulated, seed):
        found = said(log.case, log.data, checks=True, sealed=log.sealed)
        wrong = found.kinds - TRUE
        logs, refused, warned = logs + 1, refused + (found.status == 2), warned + bool(wrong)
        print(f"  {log.name:44s} {', '.join(sorted(wrong)) or '-'}", flush=True)
        for each in found.findings:
            if each.kind in wrong:
                print(f"      {each.severity} {each.kind} ({each.run}): {each.text}", flush=True)
    print(f"{logs} sound logs: {refused} refused, {warned - refused} with a false warning")


def _chosen(of: Recording, only: Sequence[str] | None) -> Iterator[tuple[str, Alteration]]:
    for title, alteration in ALTERATIONS.items():
        wanted = only is None or any(part in title for part in only)
        speeds = all(run.dq is not None for run in of.data.runs)
        possible = (len(of.data.runs) > 1 or not alteration.several) and (
            speeds or not alteration.speeds
        )
        if wanted and possible and title != "nothing":
            yield title, alteration


def _row(
    of: Recording, title: str, alteration: Alteration, usual: Said, arguments: argparse.Namespace
) -> None:
    data = alteration.alter(of.data, of.case.robot)
    found = said(of.case, data, arguments.checks)
    print(f"  {title:27s} {found.line(usual.kinds, alteration.told)}", flush=True)
    if arguments.text:
        for each in found.findings:
            if each.kind not in usual.kinds:
                print(f"      {each.severity} {each.kind} ({each.run}): {each.text}")
    keys = dict(alteration.keys(of.data.joint_names))
    if keys and arguments.keys:
        settled = said(of.with_keys(keys), data, checks=False)
        print(f"    {'with its key':25s} {settled.line(usual.kinds, ())}", flush=True)


if __name__ == "__main__":
    main()
