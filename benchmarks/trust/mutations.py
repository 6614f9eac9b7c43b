"""Ways to spoil what is valid: numbers, texts, trees, lines, bytes and samples."""

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


def pick(rng: Rng, values: Sequence[Any]) -> Any:
    """One of `values`, kept as it is."""
    return values[int(rng.integers(len(values)))]


def one_of(rng: Rng, ways: Mapping[str, Callable[[], T]]) -> tuple[str, T]:
    """What one of the ways makes, with its name."""
    name = pick(rng, list(ways))
    return name, ways[name]()


def chance(rng: Rng, share: float) -> bool:
    """True in `share` of all cases."""
    return bool(rng.random() < share)


def large(rng: Rng, exponent: float) -> int:
    """From ten to this power of it, by their logarithms."""
    return int(10 ** rng.uniform(1, exponent))


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


def places(tree: Any) -> list[tuple[Any, Any]]:
    """(holder, key) of everything inside a tree of dictionaries and lists."""
    found: list[tuple[Any, Any]] = []
    todo = [tree]
    while todo:
        node = todo.pop()
        keys: Sequence[Any] = ()
        if isinstance(node, dict):
            keys = list(node)
        elif isinstance(node, list):
            keys = range(len(node))
        for key in keys:
            found.append((node, key))
            todo.append(node[key])
    return found


def spoiled_tree(rng: Rng, tree: Any, words: Sequence[str] = ()) -> Any:
    """A copy with a few places changed, moved, added or taken away."""
    tree = copy.deepcopy(tree)
    for _ in range(1 + int(rng.geometric(0.5))):
        spots = places(tree)
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
        elif way == 5:
            holder.append(copy.deepcopy(holder[key]))
        else:
            holder.insert(0, odd_value(rng))
    return tree


def spoiled_bytes(rng: Rng, data: bytes, times: int = 0) -> bytes:
    """Bits flipped, slices cut, doubled, blanked or moved, numbers made odd."""
    raw = bytearray(data)
    for _ in range(times or 1 + int(rng.geometric(0.4))):
        if not raw:
            return bytes(rng.integers(0, 256, 16, dtype=np.uint8))
        start = int(rng.integers(len(raw)))
        size = min(int(rng.geometric(0.1)), len(raw) - start)
        way = int(rng.integers(9))
        if way <= 1:
            raw[start] ^= 1 << int(rng.integers(8))
        elif way == 2:
            raw[start] = int(rng.integers(256))
        elif way == 3:
            del raw[start : start + size]
        elif way == 4:
            raw[start:start] = raw[start : start + size]
        elif way == 5:
            raw[start : start + size] = pick(rng, (b"\0", b"\xff", b"\x7f")) * size
        elif way == 6:
            raw[start:start] = rng.bytes(size)
        elif way == 7:
            width = pick(rng, (2, 4, 8))
            value = pick(rng, (0, 1, 2**15, 2**16 - 1, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1))
            word = (value % 2 ** (8 * width)).to_bytes(width, pick(rng, ("little", "big")))
            raw[start : start + width] = word
        elif chance(rng, 0.3):
            del raw[start:]
    return bytes(raw)


def spoiled_text(rng: Rng, data: bytes, words: Sequence[bytes] = ()) -> bytes:
    """Lines cut, doubled and swapped, numbers and words replaced; now and then bytes."""
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
        name = pick(rng, list(data))
        flat = data[name].reshape(len(data[name]), -1)
        column = flat[:, int(rng.integers(flat.shape[1]))]
        rows = rng.random(len(column)) < pick(rng, (0.01, 0.2, 0.9, 1.1))
        value = pick(rng, (np.nan, np.inf, -np.inf, 0.0, 1e308, -1e308, 1e-308, 5e-324, 1e18, 7.0))
        way = int(rng.integers(6))
        if way == 0:
            column[rows] = value
        elif way == 1:
            column[:] = column[::-1].copy()
        elif way == 2:
            with np.errstate(over="ignore", under="ignore", invalid="ignore"):
                column *= value
        elif way == 3:
            column[:] = rng.permutation(column)
        elif way == 4:
            column[:] = np.round(column, int(rng.integers(-2, 3)))
        else:
            column += pick(rng, (1.7e9, 1e6, -1e12, value))
    if chance(rng, 0.2):
        most = int(pick(rng, (0, 1, 2, 9, 10, 11)))
        data = {name: array[:most] for name, array in data.items()}
    return data
