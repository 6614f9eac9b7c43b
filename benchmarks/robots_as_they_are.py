"""Is the diagnosis ever worse than a textbook's fit? Robots as they are, nothing declared.

    python -m benchmarks.robots_as_they_are [--cases N] [--seed S] [--workers W] [--json FILE]
                                            [--only INDEX …]

A case (`as_they_are.cases`) goes through files, as a user's does. Asked of each: the error of the
answer where joints move, on the held-out part, is at most 1.02 times that of the best of the three
textbook's fits (`excite identify`, inertias free, with viscous and Coulomb friction on all joints;
with offset; with armature); nothing is *confirmed* that is not there; no crash, no refusal, a
minute at most. Where friction is not the textbook's, the median of the ratio is told too.

Seeds below 1000 are for development, and so is every seed that led to a change since it was run.
"""

import argparse
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np

from benchmarks.as_they_are.cases import Case, make_case
from benchmarks.battery.processes import outcomes_of, write
from benchmarks.battery.tables import Rate
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case as Robotic
from excite_cli.api.loading import load_case, load_data
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.errors import ExciteError

BOOKS = [EVERYDAY_FRICTION, (*EVERYDAY_FRICTION, "torque_offset"), (*EVERYDAY_FRICTION, *EVERYDAY)]
AS_GOOD, SLOWEST = 1.02, 60.0


@dataclass(frozen=True)
class Outcome:
    """Errors (%) on the held-out part, names, processor time; `failure` says why there is none."""

    index: int
    label: str
    books: tuple[float, ...] = ()
    reported_book: float = np.nan
    answer: float = np.nan
    wrong: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    more: bool = False
    seconds: float = 0.0
    failure: str = ""

    @property
    def ratio(self) -> float:
        """Answer over the best textbook's fit."""
        return self.answer / min(self.books) if self.books else np.inf

    def text(self) -> str:
        """A line."""
        if self.failure:
            return f"{self.index:4d} {self.label}: {self.failure}"
        books = " ".join(f"{each:.1f}" for each in self.books)
        return (
            f"{self.index:4d} {self.ratio:5.2f}  {books} | {self.reported_book:.1f} -> "
            f"{self.answer:.1f} %  {len(self.names)} names  {self.seconds:.0f} s  {self.label}"
            + (f"  WRONG {', '.join(self.wrong)}" if self.wrong else "")
        )


def outcome_of(seed: int, index: int) -> Outcome:
    """What the program says of a case."""
    case = make_case(seed, index)
    more = case.more
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.h5"
        _write(file, case)
        try:
            return _judged(case, file, more)
        except ExciteError as refused:
            return Outcome(index, case.label, more=more, failure=f"refused: {refused}")
        except Exception as crash:  # a crash is an outcome
            return Outcome(index, case.label, more=more, failure=f"CRASH {crash!r}")


def _write(file: Path, case: Case) -> None:
    with h5py.File(file, "w") as to:
        to.attrs["joint_names"] = list(case.robot.robot.joint_names)
        for k, each in enumerate(case.recordings, start=1):
            group = to.create_group(f"runs/run_{k}")
            for name in ("t", "q", "tau"):
                group[name] = getattr(each, name)


def _judged(case: Case, file: Path, more: bool) -> Outcome:
    began = time.process_time()
    data = load_data(case.robot, file)
    found = diagnose(case.robot, data)
    seconds = time.process_time() - began
    books = []
    for kinds in BOOKS:
        effects = [{"kind": kind, "joints": "all"} for kind in kinds]
        declared = _with(case.robot, effects)
        books.append(100 * identify(declared, data).error.mean_relative_moving)
    allowed = {*EVERYDAY_FRICTION, *EVERYDAY, *case.planted}
    names = [f"{each.effect.kind}[{'+'.join(each.effect.joints)}]" for each in found.effects]
    wrong = [
        name
        for name, each in zip(names, found.effects, strict=True)
        if each.verdict is HeldOutVerdict.CONFIRMED
        and not each.approximates
        and each.effect.kind not in allowed
    ]
    told = found.textbook.error.mean_relative_moving if found.textbook else np.nan
    return Outcome(
        case.index, case.label, tuple(books), 100 * told,
        100 * found.after.mean_relative_moving, tuple(wrong), tuple(names), more, seconds,
    )  # fmt: skip


def _with(given: Robotic, effects: list[dict[str, str]]) -> Robotic:
    free = {"inertias": "free"}
    urdf = given.spec.robot.urdf
    return load_case({"robot": {"urdf": urdf}, "effects": effects, "identification": free})


def rates_of(outcomes: list[Outcome]) -> list[Rate]:
    """What is asked of all."""
    told, count = [each for each in outcomes if not each.failure], len(outcomes)
    better = sum(each.ratio <= AS_GOOD for each in told)
    return [
        Rate("answers", len(told), count, 1.0, least=True),
        Rate("no worse than the textbook", better, count, 0.99, least=True),
        Rate("wrong names confirmed", sum(bool(o.wrong) for o in told), count, 0.02, least=False),
        Rate("within a minute", sum(o.seconds <= SLOWEST for o in told), count, 1.0, least=True),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write all outcomes and rates here")
    parser.add_argument("--only", type=int, nargs="+", help="these cases, with names")
    given = parser.parse_args()
    indices = given.only if given.only is not None else range(given.cases)
    outcomes: list[Outcome] = []
    for outcome in outcomes_of(outcome_of, given.seed, list(indices), given.workers):
        outcomes.append(outcome)
        print(outcome.text(), flush=True)
        if given.only is not None:
            print("     ", ", ".join(outcome.names))
        if given.json is not None:
            write(given.json, given.seed, rates_of(outcomes), outcomes)
    ratios = [each.ratio for each in outcomes if each.more and not each.failure]
    clean = [each.ratio for each in outcomes if not each.more and not each.failure]
    for rate in rates_of(outcomes):
        print(rate.text())
    print(f"median of the ratio: {np.median(ratios):.2f} with more planted ({len(ratios)})")
    if clean:
        print(f"                     {np.median(clean):.2f} of clean ones ({len(clean)})")


if __name__ == "__main__":
    main()
