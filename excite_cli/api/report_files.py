"""Files of any kind for one report: told apart by what they hold, in the order of the loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.api.paths import refuse_twice
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import FileError
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_fit import StoredFit
from excite_cli.scoring.records import Score
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis
from excite_cli.store.fit_file import is_fit, read_fit
from excite_cli.store.own_file import PROGRAM
from excite_cli.store.result_file import read_result
from excite_cli.store.score_file import is_score, read_score


@dataclass(frozen=True)
class Told:
    """One file: its name on the page, and what it holds."""

    path: Path
    name: str
    content: Result | StoredFit | Diagnosis | Score

    @property
    def earlier(self) -> frozenset[str]:
        """Names of the files that it was made on top of."""
        priors = self.content.priors if isinstance(self.content, Result) else ()
        return frozenset(Path(prior).name for prior in priors)

    @property
    def stage(self) -> int:
        """Motions come first, then what was identified, diagnosed, and scored."""
        return (Result, StoredFit, Diagnosis, Score).index(type(self.content))


def read_files(paths: Sequence[Path]) -> tuple[Told, ...]:
    """Everything that `paths` hold, motions before fits before diagnoses before what follows them.

    Raises
    ------
    FileError
        A file is missing, given twice, damaged, or of another kind.
    """
    refuse_twice(paths)
    stems = [path.stem for path in paths]
    names = [
        path.stem if stems.count(path.stem) == 1 else str(path.with_suffix("")) for path in paths
    ]
    found = [Told(path, name, _read(path)) for path, name in zip(paths, names, strict=True)]
    return in_order(found)


def _read(path: Path) -> Result | StoredFit | Diagnosis | Score:
    if path.is_dir():
        raise FileError(f"{path} is a folder. Give files: result, fit or diagnosis (.h5).")
    if is_fit(path):
        return read_fit(path)
    if is_diagnosis(path):
        return read_diagnosis(path)
    if is_score(path):
        return read_score(path)
    try:
        return read_result(path)
    except FileError as error:
        raise FileError(
            f"{error} A report is made of results (`{PROGRAM} optimize`, `{PROGRAM} "
            f"compare-random`), fits (`{PROGRAM} identify`), diagnoses (`{PROGRAM} diagnose`) and "
            f"scores (`{PROGRAM} score`)."
        ) from error


def in_order(files: Sequence[Told]) -> tuple[Told, ...]:
    """By stage, but nothing before the files it was made on top of."""
    left, placed = sorted(files, key=lambda each: each.stage), list[Told]()
    while left:
        waiting = {each.path.name for each in left}
        ready = [each for each in left if not each.earlier & (waiting - {each.path.name})]
        chosen = (ready or left)[0]
        placed.append(chosen)
        left.remove(chosen)
    return tuple(placed)
