"""What changed between days: `excite compare`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from excite_cli.api.arguments import checked, page_path
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.errors import ConfigError, FileError
from excite_cli.report.page import render
from excite_cli.scoring.changes import Changes, Snapshot, changes_of, of_diagnosis, of_fit, of_score
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis
from excite_cli.store.fit_file import is_fit, read_fit
from excite_cli.store.score_file import is_score, read_score
from excite_cli.summary.changes import changes_answer as changes_answer
from excite_cli.summary.changes import trend_page


@checked()
def compare(
    files: Sequence[str | Path],
    covariates: Mapping[str, Sequence[float]] | None = None,
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
) -> Changes:
    """What changed between the days of fits, diagnoses or scores: `excite compare`.

    `files` of one kind and one robot, in order of time (sorted by their stamps if all have some).
    `covariates`: further columns with a value per file, as {"temp": [21.0, …]}; those that the
    files know themselves are means of `measurement.covariates`. Their influence is taken out.
    `output`: a page (HTML) with friction and the rest of every joint over the days.

    Returns
    -------
    Changes
        `changes` of every parameter, the surest first: `before`, `after`, `std` of the change,
        `since` which file, and `p_value`, corrected for the number of parameters and days.

    Raises
    ------
    FileError, ConfigError
        A file cannot be read, is of another kind or robot; there are fewer than two days; columns
        do not fit; `output` is no name of a page, or exists.
    """
    page = None if output is None else page_path(output)
    with held({"output": page}, overwrite, [Path(each) for each in files]):
        found = _compared(files, covariates)
        if page is not None:
            text = render(trend_page(found, f"{len(found.days)} days of a robot"))
            write_text_atomically(page, text)
        return found


def _compared(
    files: Sequence[str | Path], covariates: Mapping[str, Sequence[float]] | None
) -> Changes:
    if not files:
        raise ConfigError("compare: give two files or more: fits, diagnoses or scores.")
    paths = [Path(each) for each in files]
    found = [_snapshots(path) for path in paths]
    if len({kind for kind, _, _ in found}) > 1:
        told = ", ".join(f"{path}: {kind}" for path, (kind, _, _) in zip(paths, found, strict=True))
        raise FileError(
            f"compare: the files are of different kinds ({told}). Identify all logs, "
            "or diagnose all."
        )
    if len({robot for _, robot, _ in found}) > 1:
        raise FileError("compare: the files are of different robots. Give those of one.")
    days = [day for _, _, own in found for day in own]
    for name, values in (covariates or {}).items():
        if len(values) != len(days):
            raise ConfigError(
                f"--covariate {name}: {len(values)} values for {len(days)} days. Give one for each."
            )
        days = [
            replace(day, covariates={**day.covariates, name: float(value)})
            for day, value in zip(days, values, strict=True)
        ]
    if len(days) < 2:
        raise ConfigError("compare: there is one day only. Give two files or more.")
    stamps = [day.epoch for day in days]
    if all(stamp is not None for stamp in stamps) and len(set(stamps)) == len(stamps):
        days = sorted(days, key=lambda day: day.epoch or 0.0)
    return changes_of(days)


def _snapshots(path: Path) -> tuple[str, str, list[Snapshot]]:
    """Kind, robot, and days of a file."""
    name = path.stem
    if is_fit(path):
        stored = read_fit(path)
        return "fit", stored.fingerprint, [of_fit(name, stored)]
    if is_diagnosis(path):
        found = read_diagnosis(path)
        return "diagnosis", found.fingerprint, [of_diagnosis(name, found)]
    if is_score(path):
        score = read_score(path)
        return "score", ",".join(score.joint_names), of_score(name, score)
    if not path.is_file():
        raise FileError(f"There is no file {path}.")
    raise FileError(f"{path} is no fit, diagnosis or score: it cannot be compared.")
