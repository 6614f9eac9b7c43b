"""Ways to spoil what is valid: numbers, texts, trees, lines and bytes."""

import copy
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

Rng = np.random.Generator

_NUMBERS = (
    0,
    1,
    -1,
    2,
    3,
    0.5,
    1e-300,
    1e300,
    -1e300,
    1e308 * 10,
    -1e308 * 10,
    float("nan"),
    2**31,
    2**31 - 1,
    -(2**31),
    2**32,
    2**63,
    2**64,
    10**30,
    1e-12,
    1e9,
    1e-320,
    999999999,
    100000,
    7.5,
)
_TEXTS = (
    "",
    " ",
    "null",
    "~",
    "true",
    "nan",
    ".inf",
    "0",
    "-",
    ":",
    "\x00",
    "\t",
    "\n",
    "\u202e",
    "\ufeff",
    "é",
    "名前",
    "🤖" * 3,
    "a" * 300,
    "../../etc/passwd",
    "/etc/passwd",
    "/dev/zero",
    "/dev/stdin",
    "%s%n",
    "${HOME}",
    "$(id)",
    "__import__('os')",
    "\x1b[31mred",
    "<b>",
    "'; --",
    "{}",
    "[]",
    "*a",
    "&a",
    "!!python/object/apply:os.system",
    "!!binary",
    "1e999",
    "0x10",
    "1_000",
    "2001-01-01",
    "NaN",
    "١٢٣",
    "posture",
    "auto",
    "all",
    "none",
    "base",
    ".",
    "..",
    "/",
    "\\",
)
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def pick(rng: Rng, values: Sequence[Any]) -> Any:
    """One of `values`, kept as it is."""
    return values[int(rng.integers(len(values)))]


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
        size = int(rng.integers(1, 40))
        return "".join(
            chr(int(c)) for c in rng.integers(1, 0x2FFF, size) if not 0xD800 <= c < 57344
        )
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
            raw[start:start] = bytes(rng.integers(0, 256, size, dtype=np.uint8))
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
        if way == 0:
            del lines[at]
        elif way == 1:
            lines[at:at] = [lines[at]] * int(rng.integers(1, 4))
        elif way == 2:
            lines[at], lines[other] = lines[other], lines[at]
        elif way <= 4:
            found = list(_NUMBER.finditer(data))
            if found:
                spot = pick(rng, found)
                new = repr(odd_number(rng)).encode()
                data = data[: spot.start()] + new + data[spot.end() :]
                continue
        elif way == 5 and words:
            line, spot = lines[at], int(rng.integers(len(lines[at]) + 1))
            lines[at] = line[:spot] + pick(rng, words) + line[spot:]
        elif way == 6:
            line, spot = lines[at], int(rng.integers(len(lines[at]) + 1))
            lines[at] = line[:spot] + odd_text(rng).encode("utf-8", "replace") + line[spot:]
        else:
            data = spoiled_bytes(rng, data, 1)
            continue
        data = b"\n".join(lines)
    return data
