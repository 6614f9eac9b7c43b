"""From a config, logs and varied keys to the cases of a study, all checked before any is done."""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from excite_cli.errors import ConfigError, FileError
from excite_cli.given_files import require_stored
from excite_cli.study.case import StudyCase, StudyTask, contents_of, request_of
from excite_cli.study.vary import VariedKey, combinations

_LONGEST = 100  # bytes of a name: with digest, suffix and `.part` a file system still takes it


def planned_cases(
    task: StudyTask, logs: Sequence[Path], varied: Sequence[VariedKey]
) -> list[StudyCase]:
    """Every combination of values, for every log if there are any.

    Raises
    ------
    ConfigError
        Nothing is varied and there is no log; the config does not allow a combination; or two
        combinations are the same.
    FileError
        A log does not exist, or is given twice.
    """
    if not logs and not varied:
        raise ConfigError(
            "A study needs something to vary: --vary KEY=VALUE,VALUE,…, or logs to work on."
        )
    _check_logs(logs)
    chosen = combinations(varied)
    short = _short_keys([each.key for each in varied])
    cases: list[StudyCase] = []
    contents = cache(contents_of)
    each: Sequence[Path | None] = [log.resolve() for log in logs] or [None]
    for log in each:
        for values in chosen:
            settings = [f"{key}={value}" for key, value in values.items()]
            words = [f"{short[key]}={_plain(value)}" for key, value in values.items()]
            name = "_".join([*([_plain(log.stem)] if log is not None else []), *words])
            overrides = [*task.overrides, *settings]
            request = request_of(task.config, overrides, log, task.diagnosed, contents)
            cases.append(StudyCase(_cut(name), values, log, request))
    _check_different(cases)
    return _distinct(cases)


def _check_logs(logs: Sequence[Path]) -> None:
    seen: set[Path] = set()
    for log in logs:
        require_stored(log)
        if log.resolve() in seen:
            raise FileError(f"{log} is given twice.")
        seen.add(log.resolve())


def _check_different(cases: Sequence[StudyCase]) -> None:
    seen: dict[str, StudyCase] = {}
    for case in cases:
        other = seen.setdefault(case.request, case)
        if other is not case:
            twice = " and ".join(
                ", ".join(f"{key}={value}" for key, value in each.values.items())
                for each in (other, case)
            )
            raise ConfigError(f"--vary: {twice} ask for the same. Give one of them.")


def _cut(name: str) -> str:
    return name.encode()[:_LONGEST].decode(errors="ignore")


def _short_keys(keys: Sequence[str]) -> dict[str, str]:
    """The last word of every key where that tells them apart, else the whole key."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: word if last.count(word) == 1 else key for key, word in zip(keys, last, strict=True)
    }


def _plain(text: str) -> str:
    """What a name of a file may hold of a value or a name: letters, digits, points and dashes."""
    return re.sub(r"[^\w.+-]+", "-", text.strip("[]{}'\" "))


def _distinct(cases: list[StudyCase]) -> list[StudyCase]:
    """Names that are the same once they are file names get the request's first letters."""
    names = [case.name.lower() for case in cases]
    return [
        StudyCase(f"{case.name}_{case.request[:8]}", case.values, case.log, case.request)
        if names.count(case.name.lower()) > 1
        else case
        for case in cases
    ]
