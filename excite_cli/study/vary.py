"""What a study varies: keys of the config with the values that each takes."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from excite_cli.errors import ConfigError

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
