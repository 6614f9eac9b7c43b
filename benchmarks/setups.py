"""Are mistakes of set-up found before physics? Logs altered as people do it, and sound ones.

    python -m benchmarks.setups [--logs NAME …] [--mistakes NAME …] [--seed S] [--pairs N]
    python -m benchmarks.setups --let-through [--logs NAME …] [--mistakes NAME …] [--seed S]
    python -m benchmarks.setups --sound N [--seed S]

Every mistake of `altered.mistakes` is made in logs of real and simulated robots, with sizes drawn
at random. Asked of `excite inspect`: the right row, the right joints, the right key, no other row;
and with what it would set, that the textbook's fit (viscous and Coulomb friction, offset, armature
on all joints) misses at most 1.2 times what it misses of the log as it was. With `--pairs` two
mistakes at once: both told. `--let-through`: altered logs without a fault are diagnosed as they
are; asked is that no effect is *confirmed* which is not confirmed of the log as it was. `--sound`:
logs in which nothing is wrong, of which nothing should be said.
"""

import argparse
import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.altered.mistakes import MISTAKES, Altered
from benchmarks.altered.recordings import NAMES, recording
from benchmarks.altered.sound import TRUE, sound_logs
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.identifying import identify
from excite_cli.api.inspecting import inspect
from excite_cli.api.loading import Case, load_case
from excite_cli.checks.check_result import CheckResult
from excite_cli.config.commented_yaml import with_values
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.errors import ExciteError
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.hdf5_writer import write_dataset

AS_GOOD, HARMLESS = 1.2, 1.05
_WITHOUT = "measurement.without_torque"  # settles a torque of which nobody knows the unit


@dataclass(frozen=True)
class Outcome:
    """What came of a mistake: which of the things that were asked hold."""

    label: str
    row: bool
    joints: bool
    key: bool
    back: bool
    others: tuple[str, ...] = ()
    harmless: bool = False
    seconds: float = 0.0
    said: str = ""

    @property
    def right(self) -> bool:
        """Whether the right row has the right joints and key; or nothing was to be said."""
        return (self.row and self.joints and self.key) or self.harmless

    def line(self) -> str:
        """A row of the table."""
        all_of = (self.row, self.joints, self.key, self.back)
        marks = "".join(c if good else "-" for c, good in zip("rjkb", all_of, strict=True))
        also = f"  ALSO {', '.join(self.others)}" if self.others else ""
        words = f"{self.label}{' harmless' * self.harmless}{also}  {self.said}"
        good = "ok" if self.right and self.back else "!!"
        return f"{good} {marks} {self.seconds:4.1f} s  {words}"


@contextmanager
def _file(data: Dataset) -> Iterator[Path]:
    """The data in a file, as long as it is looked at."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.h5"
        write_dataset(file, data, {})
        yield file


def _case(case: Case, robot: dict[str, object]) -> Case:
    tree = case.spec.model_dump(mode="json", exclude_unset=True)
    measured = tree.get("measurement", {})
    kept = {key: measured[key] for key in ("filter", "without_torque") if key in measured}
    urdf = str(case.spec.robot.urdf)
    if not Path(urdf).is_absolute() and (case.folder / urdf).exists():
        tree["robot"]["urdf"] = str((case.folder / urdf).resolve())
    dirs = tree["robot"].get("package_dirs", [])
    tree["robot"]["package_dirs"] = [str((case.folder / each).resolve()) for each in dirs]
    return load_case({"robot": {**tree["robot"], **robot}, "measurement": kept})


def _error(case: Case, file: Path) -> float:
    """Of the textbook's fit on held-out data; infinite where it is refused."""
    effects = [{"kind": kind, "joints": "all"} for kind in (*EVERYDAY_FRICTION, *EVERYDAY)]
    tree = case.spec.model_dump(mode="json", exclude_unset=True)
    trusted = with_values(tree, {"measurement.trust": True})
    try:
        found = identify(load_case({**trusted, "effects": effects}), file, tell=lambda note: None)
    except ExciteError:
        return float("inf")
    return found.error.mean_relative_moving


def _set(case: Case, settings: object) -> Case:
    tree = case.spec.model_dump(mode="json", exclude_unset=True)
    return load_case(with_values(tree, dict(settings)))  # type: ignore[call-overload]


def _judged(
    label: str, case: Case, altered: Altered, usual: frozenset[str], sound: float
) -> Outcome:
    with _file(altered.data) as file:
        began = time.process_time()
        try:
            found = inspect(_case(case, altered.robot), file, tell=lambda note: None)
        except ExciteError as refused:
            return Outcome(label, False, False, False, False, said=f"refused: {refused}")
        seconds = time.process_time() - began
        told = [e for e in found.results if e.status != "ok" or (altered.told and e.evidence)]
        own = [each for each in told if each.name in altered.rows]
        named = {joint for each in own for joint in each.joints}
        key = not altered.key or bool({altered.key, _WITHOUT} & {*found.settings})
        before = _error(_case(case, altered.robot), file)
        after = before
        if found.settings:
            after = _error(_set(_case(case, altered.robot), found.settings), file)
        if altered.run and {each.runs for each in own} == {altered.run}:
            after = sound  # no key: the person leaves it out, and the others are as they were
        if altered.unknown and own and not found.settings:
            after = sound
        harmless = not own and before <= HARMLESS * sound
        right = {*altered.rows, *altered.also, "limits of the joints"} | usual
        others = {e.name for e in told if e.status != "ok"} - right
        return Outcome(
            label, bool(own) or not altered.rows, {*altered.joints} <= named, key,
            after <= AS_GOOD * sound, tuple(sorted(others)), harmless, seconds,
            f"{100 * sound:.1f} {100 * before:.1f} {100 * after:.1f} %",
        )  # fmt: skip


def _usual(case: Case, data: Dataset) -> tuple[frozenset[str], float]:
    """Rows that have a doubt in the log as it is, and the textbook's error."""
    with _file(data) as file:
        found = inspect(_case(case, {}), file, tell=lambda note: None)
        return frozenset(_doubted(found.results)), _error(_case(case, {}), file)


def _doubted(results: tuple[CheckResult, ...]) -> list[str]:
    return [each.name for each in results if each.status != "ok"]


def _both(one: Altered, other: Altered) -> Altered:
    return Altered(
        other.data, (*one.rows, *other.rows), (*one.joints, *other.joints), "",
        {**one.robot, **other.robot}, also=(*one.also, *other.also),
    )  # fmt: skip


def altered_logs(logs: list[str], mistakes: list[str], seed: int) -> None:
    """Every mistake in every log."""
    outcomes: list[Outcome] = []
    for name in logs:
        of = recording(name)
        usual, sound = _usual(of.case, of.data)
        print(f"{name}: textbook {100 * sound:.1f} %; as it is: {', '.join(sorted(usual)) or '-'}")
        for mistake in mistakes:
            rng = np.random.default_rng([seed, *map(ord, name + mistake)])
            altered = MISTAKES[mistake](of.data, of.case, rng)
            outcomes.append(_judged(f"{name}: {mistake}", of.case, altered, usual, sound))
            print(outcomes[-1].line(), flush=True)
    count = len(outcomes)
    asked = [each for each in outcomes if not each.harmless]
    print(f"right row, joints, key: {sum(e.right for e in outcomes)} of {count} (≥ 97 %)")
    print(
        f"  of those that the textbook's fit notices: {sum(e.right for e in asked)} of {len(asked)}"
    )
    print(f"textbook's error is back: {sum(e.back for e in outcomes)} of {count} (≥ 95 %)")
    print(f"another row, too: {sum(bool(e.others) for e in outcomes)} of {count}")
    print(f"slowest: {max(e.seconds for e in outcomes):.1f} s")


def pairs(logs: list[str], mistakes: list[str], seed: int, wanted: int) -> None:
    """Two mistakes at once."""
    rng, told, wrong, count, k = np.random.default_rng(seed), 0, 0, 0, -1
    known = {name: _usual(recording(name).case, recording(name).data) for name in logs}
    while count < wanted:
        k += 1
        name, (first, second) = str(rng.choice(logs)), rng.choice(mistakes, 2, replace=False)
        of = recording(name)
        usual, sound = known[name]
        one, alone = (
            MISTAKES[each](of.data, of.case, np.random.default_rng([seed, k, place]))
            for place, each in enumerate((first, second))
        )
        if one.key and one.key == alone.key and not (one.joints or alone.joints):
            continue  # two answers to one question of all joints: only their product is in the data
        count += 1
        other = MISTAKES[second](one.data, of.case, np.random.default_rng([seed, k, 1]))
        robot = {**one.robot, **other.robot}
        label = f"{name}: {first} + {second}"
        both = _judged(label, of.case, _both(one, other), usual, sound)
        # What no fit notices of a log that is sound else is not asked for.
        asked = [each for each in (one, alone) if _is_noticed(of.case, each, sound)]
        each_told = all(
            _judged(label, of.case, replace(each, data=other.data, robot=robot), usual, sound).row
            for each in asked
        )
        told, wrong = told + each_told, wrong + bool(both.others)
        print(f"{'ok' if each_told else '!!'} {len(asked)} {both.line()}", flush=True)
    print(f"both told: {told} of {count} (≥ 85 %); another row: {wrong} (≤ 2 %)")


def let_through(logs: list[str], mistakes: list[str], seed: int) -> None:
    """What a diagnosis confirms of altered logs in which nothing is wrong for certain."""
    count = wrong = 0
    for name in logs:
        of = recording(name)
        known = _confirmed(_case(of.case, {}), of.data)
        print(f"{name}: {', '.join(sorted(known or ())) or '-'}", flush=True)
        for mistake in mistakes:
            rng = np.random.default_rng([seed, *map(ord, name + mistake)])
            altered = MISTAKES[mistake](of.data, of.case, rng)
            names = _confirmed(_case(of.case, altered.robot), altered.data)
            if names is not None:
                more = sorted(names - (known or set()))
                count, wrong = count + 1, wrong + bool(more)
                print(f"{'!!' if more else 'ok'} {name}: {mistake}: {', '.join(more)}", flush=True)
    print(f"more is confirmed than of the log as it was: {wrong} of {count} let through (0)")


def _confirmed(case: Case, data: Dataset) -> set[str] | None:
    """Effects that a diagnosis confirms beyond the textbook's; None where it refuses the log."""
    with _file(data) as file:
        try:
            found = diagnose(case, file, tell=lambda note: None)
        except ExciteError:
            return None
    return {
        f"{each.effect.kind}@{','.join(each.effect.joints)}"
        for each in found.effects
        if each.verdict is HeldOutVerdict.CONFIRMED
        and each.effect.kind not in (*EVERYDAY_FRICTION, *EVERYDAY)
    }


def _is_noticed(case: Case, altered: Altered, sound: float) -> bool:
    """Whether the textbook's error rises."""
    with _file(altered.data) as file:
        return not _error(_case(case, altered.robot), file) <= HARMLESS * sound


def sound(count: int, seed: int) -> None:
    """Logs of which nothing should be said."""
    words: Counter[str] = Counter()
    logs = 0
    for each in sound_logs(count, seed):
        with _file(each.data) as file:
            try:
                found = inspect(_case(each.case, {}), file, tell=lambda note: None)
                true = TRUE | ({"mount"} if each.leans else set())
                said = [e for e in found.results if e.status != "ok" and e.kind not in true]
            except ExciteError as refused:
                said = [CheckResult("refused", "", "fault", str(refused))]
        logs += 1
        words.update(e.status for e in said[:1])
        print(
            f"{each.name}: {'; '.join(f'{e.name}: {e.evidence[:150]}' for e in said) or '-'}",
            flush=True,
        )
    print(f"{logs} sound logs: {dict(words)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", nargs="+", default=list(NAMES), choices=NAMES)
    parser.add_argument("--mistakes", nargs="+", default=list(MISTAKES), choices=list(MISTAKES))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--sound", type=int, default=0, metavar="N")
    parser.add_argument("--let-through", action="store_true")
    given = parser.parse_args()
    if given.let_through:
        let_through(given.logs, given.mistakes, given.seed)
    elif given.sound:
        sound(given.sound, given.seed)
    elif given.pairs:
        pairs(given.logs, given.mistakes, given.seed, given.pairs)
    else:
        altered_logs(given.logs, given.mistakes, given.seed)


if __name__ == "__main__":
    main()
