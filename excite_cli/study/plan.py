"""From a config, logs and varied keys to the cases of a study, all checked before any is done."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from excite_cli.errors import ConfigError, FileError
from excite_cli.given_files import require_stored
from excite_cli.study.case import StudyCase, StudyTask, contents_of, request_of

# What a study varies: keys of the config with the values that each takes.

_RANGE = re.compile(r"(-?\d+)\.\.(-?\d+)")
_OPENING, _CLOSING = "[{", "]}"
MOST = 100_000


@dataclass(frozen=True)
class VariedKey:
    """A key of the config and its values, as YAML text."""

    key: str
    values: tuple[str, ...]


def parse_vary(text: str) -> VariedKey:
    """`key.path=V1,V2,…`; `1..8` stands for the whole numbers from 1 to 8.

    Commas within brackets, braces and quotes belong to the value.

    Raises
    ------
    ConfigError
        There is no key, a value is missing or given twice, or a range is too long or backward.
    """
    key, separator, listed = text.partition("=")
    key = key.strip()
    if not separator or not key:
        raise ConfigError(
            f"--vary {text}: write key.path=VALUE,VALUE,…, for example seed=1..4 or "
            "trajectory.harmonics=3,5."
        )
    values = [value for part in _parts(listed) for value in _expanded(text, part.strip())]
    if not all(values):
        raise ConfigError(f"--vary {text}: a value is missing; write {key}=VALUE,VALUE,…")
    twice = next((value for value in values if values.count(value) > 1), None)
    if twice is not None:
        raise ConfigError(f"--vary {text}: {twice} is given twice.")
    return VariedKey(key, tuple(values))


def combinations(varied: Sequence[VariedKey]) -> list[dict[str, str]]:
    """Every combination of values by key, the last key changing fastest; one, empty, of nothing.

    Raises
    ------
    ConfigError
        A key is varied twice, or there are more than `MOST`.
    """
    keys = [each.key for each in varied]
    for key in keys:
        if keys.count(key) > 1:
            raise ConfigError(f"--vary {key} is given twice. Give all its values at once.")
    count = 1
    for each in varied:
        count *= len(each.values)
    if count > MOST:
        raise ConfigError(f"--vary: {count} combinations are more than {MOST}. Vary less.")
    return [
        dict(zip(keys, chosen, strict=True))
        for chosen in itertools.product(*(each.values for each in varied))
    ]


def _expanded(text: str, part: str) -> list[str]:
    """The whole numbers of a range, or the value itself."""
    match = _RANGE.fullmatch(part)
    if match is None:
        return [part]
    first, last = int(match[1]), int(match[2])
    if last < first or last - first >= MOST:
        raise ConfigError(
            f"--vary {text}: {part} must go upwards, over at most {MOST} whole numbers."
        )
    return [str(value) for value in range(first, last + 1)]


def _parts(text: str) -> list[str]:
    """The text between commas that stand in no bracket, brace or quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter in _OPENING:
            depth += 1
        elif letter in _CLOSING:
            depth -= 1
        elif letter == "," and depth <= 0:
            parts.append("")
            continue
        parts[-1] += letter
    return parts


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
