"""Ways to spoil what is valid: numbers, texts, trees, lines, bytes and samples.

What is written by hand to run code, to read other files or to fill memory stands in `tests/trust/`,
each with the message that it must get.
"""

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

Rng = np.random.Generator
T = TypeVar("T")

_WHOLE = (0, 1, -1, 2, 3, 2**31, 2**31 - 1, -(2**31), 2**32, 2**63, 2**64, 10**30, 999999999, 10**5)
_REAL = (0.5, 1e-300, 1e300, -1e300, np.inf, -np.inf, np.nan, 1e-12, 1e9, 1e-320, 7.5)
_NUMBERS = (*_WHOLE, *map(float, _REAL))
# Words without spaces.
_ODD_WORDS = """
null ~ true nan .inf 0 - : é 名前 %s%n ${HOME} $(id) <b> {} [] *a &a !!binary NaN ١٢٣ 1e999
0x10 1_000 2001-01-01 posture auto all none base . .. / ../../etc/passwd /etc/passwd
/dev/zero /dev/stdin \\
!!python/object/apply:os.system __import__('os') \x1b[31mred
"""
_TEXTS = (
    *_ODD_WORDS.split(),
    *("", " ", "\x00", "\t", "\n", "\u202e", "\ufeff", "🤖" * 3, "a" * 300, "'; --"),
)
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
# What a field of so many bytes may claim.
_CLAIMS = (0, 1, 2**15, 2**16 - 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)
_CODES = ("utf-16", "utf-32", "utf-7", "cp037", "utf-8-sig")
_SAMPLES = (np.nan, np.inf, -np.inf, 0.0, 1e308, -1e308, 1e-308, 5e-324, 1e18, 7.0)
_LARGEST_FLOOD = 5.5  # power of ten


def pick(rng: Rng, values: Sequence[Any]) -> Any:
    """One of `values`, kept as it is."""
    return values[int(rng.integers(len(values)))]


def one_of(rng: Rng, ways: Mapping[str, tuple[float, Callable[[], T]]]) -> tuple[str, T]:
    """What one of the ways makes, with its name; each has a weight."""
    weights = np.array([weight for weight, _ in ways.values()], dtype=float)
    name = list(ways)[int(rng.choice(len(ways), p=weights / weights.sum()))]
    return name, ways[name][1]()


def chance(rng: Rng, share: float) -> bool:
    """True in `share` of all cases."""
    return bool(rng.random() < share)


def odd_number(rng: Rng) -> Any:
    """A number that is seldom meant."""
    if chance(rng, 0.3):
        return float(rng.normal() * 10.0 ** rng.integers(-8, 9))
    return pick(rng, _NUMBERS)


def odd_text(rng: Rng) -> str:
    """A text that is seldom meant."""
    if chance(rng, 0.2):
        return "".join(map(chr, rng.integers(1, 0x2FFF, int(rng.integers(1, 40))).tolist()))
    return str(pick(rng, _TEXTS))


def odd_value(rng: Rng, depth: int = 0) -> Any:
    """Any plain value, nested at times."""
    kind = int(rng.integers(8 if depth < 4 else 4))
    if kind in (0, 1):
        return odd_number(rng)
    if kind == 2:
        return odd_text(rng)
    if kind == 3:
        return pick(rng, (None, True, False))
    if kind in (4, 5):
        return [odd_value(rng, depth + 1) for _ in range(int(rng.integers(0, 5)))]
    return {odd_text(rng): odd_value(rng, depth + 1) for _ in range(int(rng.integers(0, 4)))}


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """(holder, key) of everything inside a tree of dictionaries and lists."""
    if not isinstance(tree, (dict, list)):
        return []
    keys = list(tree) if isinstance(tree, dict) else range(len(tree))
    return [(tree, key) for key in keys] + [x for key in keys for x in _places(tree[key])]


def spoiled_tree(rng: Rng, tree: Any, words: Sequence[str] = ()) -> Any:
    """A copy with a few places changed, moved, added or taken away."""
    tree = copy.deepcopy(tree)
    for _ in range(1 + int(rng.geometric(0.5))):
        spots = _places(tree)
        if not spots:
            return odd_value(rng)
        holder, key = pick(rng, spots)
        way = int(rng.integers(8))
        if way <= 1:
            holder[key] = odd_value(rng)
        elif way == 2:
            holder[key] = odd_number(rng)
        elif way == 3:
            del holder[key]
        elif way == 4:
            other, from_key = pick(rng, spots)
            holder[key] = copy.deepcopy(other[from_key])
        elif isinstance(holder, dict):
            new = pick(rng, words) if words and chance(rng, 0.7) else odd_text(rng)
            holder[new] = holder.pop(key) if way == 5 else odd_value(rng)
        else:
            holder.insert(0, copy.deepcopy(holder[key]) if way == 5 else odd_value(rng))
    return tree


def spoiled_bytes(rng: Rng, data: bytes, times: int = 0) -> bytes:
    """Bits flipped, slices cut, doubled, blanked or moved, numbers made odd."""
    raw = bytearray(data)
    for _ in range(times or 1 + int(rng.geometric(0.4))):
        if not raw:
            return rng.bytes(16)
        start = int(rng.integers(len(raw)))
        size = min(int(rng.geometric(0.1)), len(raw) - start)
        part, width = slice(start, start + size), pick(rng, (2, 4, 8))
        way = int(rng.integers(8))
        if way <= 1:
            raw[start] ^= 1 << int(rng.integers(8))
        elif way == 2:
            del raw[part]
        elif way == 3:
            raw[start:start] = raw[part]
        elif way == 4:
            raw[part] = pick(rng, (b"\0", b"\xff", b"\x7f")) * size
        elif way == 5:
            raw[part] = rng.bytes(size)
        elif way == 6:
            claim = pick(rng, _CLAIMS) % 2 ** (8 * width)
            raw[start : start + width] = claim.to_bytes(width, pick(rng, ("little", "big")))
        elif chance(rng, 0.3):
            del raw[start:]
    return bytes(raw)


def spoiled_text(rng: Rng, data: bytes, words: Sequence[bytes] = ()) -> bytes:
    """Lines cut, doubled and swapped, numbers and words replaced; now and then bytes or the code.

    Seldom one of the `words` many thousand times: depth, long numbers, names and lines.
    """
    if words and chance(rng, 0.15):
        at, count = int(rng.integers(len(data) + 1)), int(10 ** rng.uniform(1, _LARGEST_FLOOD))
        return data[: at * chance(rng, 0.7)] + pick(rng, words) * count + data[at:]
    if chance(rng, 0.03):
        return data.decode("utf-8", "replace").encode(pick(rng, _CODES), "replace")
    for _ in range(1 + int(rng.geometric(0.5))):
        lines = data.split(b"\n")
        at, other = (int(rng.integers(len(lines))) for _ in range(2))
        way = int(rng.integers(8))
        numbers = list(_NUMBER.finditer(data)) if way in (3, 4) else []
        if way == 0:
            del lines[at]
        elif way == 1:
            lines[at:at] = [lines[at]] * int(rng.integers(1, 4))
        elif way == 2:
            lines[at], lines[other] = lines[other], lines[at]
        elif numbers:
            spot = pick(rng, numbers)
            new = repr(odd_number(rng)).encode()
            lines = [data[: spot.start()] + new + data[spot.end() :]]
        elif way in (5, 6):
            line, cut = lines[at], int(rng.integers(len(lines[at]) + 1))
            own = pick(rng, words) if words and way == 5 else odd_text(rng).encode(errors="replace")
            lines[at] = line[:cut] + own + line[cut:]
        else:
            lines = [spoiled_bytes(rng, data, 1)]
        data = b"\n".join(lines)
    return data


def odd_samples(rng: Rng, data: Mapping[str, Any]) -> dict[str, Any]:
    """Columns with NaN, jumps, constants, huge or tiny values, time that goes back or stands."""
    data = {name: array.copy() for name, array in data.items()}
    for _ in range(int(rng.integers(1, 4))):
        array = data[pick(rng, list(data))]
        column = array.reshape(len(array), -1).T
        column = column[int(rng.integers(len(column)))]
        rows = rng.random(len(column)) < pick(rng, (0.01, 0.2, 0.9, 1.1))
        value, digits = pick(rng, _SAMPLES), int(rng.integers(-2, 3))
        with np.errstate(all="ignore"):
            column[:] = pick(rng, (
                np.where(rows, value, column), column[::-1], column * value,
                np.round(column, digits), rng.permutation(column),
                column + pick(rng, (1.7e9, 1e6, -1e12, value)),
            ))  # fmt: skip
    if chance(rng, 0.2):
        most = int(pick(rng, (0, 1, 2, 9, 10, 11)))
        data = {name: array[:most] for name, array in data.items()}
    return data
