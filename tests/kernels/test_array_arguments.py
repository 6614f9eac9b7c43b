"""No compiled function is entered with arrays that do not fit."""

import ctypes
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.kernels import compiled
from excite_cli.kernels.array_arguments import Array, CheckedFunction, Number, Size
from excite_cli.kernels.signatures import SIGNATURES

# Any sizes that differ from each other; those of a table's knots are at least 8.
SIZES = {letter: 2 + i for i, letter in enumerate("TBVnRrCPK")} | {"F": 12, "S": 13}


class Recorder:
    """Stands in for the function of the library, and keeps what it is given."""

    restype: Any = None
    argtypes: Any = None

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []

    def __call__(self, *given: Any) -> None:
        self.calls.append(given)


def fitting(name: str) -> list[Any]:
    """Arguments of the right shapes for a function."""
    return [
        1.0 if isinstance(one, Number) else one.empty(SIZES)
        for one in SIGNATURES[name]
        if isinstance(one, Number) or (isinstance(one, Array) and one.use != "scratch")
    ]


def given_arrays(name: str) -> list[tuple[int, Array]]:
    """The arrays that the caller gives, and their places."""
    given = [one for one in SIGNATURES[name] if not isinstance(one, Size) and one.name != "work"]
    return [(place, one) for place, one in enumerate(given) if isinstance(one, Array)]


def refused(name: str, given: list[Any], kind: type[Exception], words: str) -> None:
    """The call is refused with these words before C is entered."""
    recorder = Recorder()
    with pytest.raises(kind, match=words):
        CheckedFunction(name, recorder, SIGNATURES[name])(given)
    assert recorder.calls == []


@pytest.mark.parametrize("name", SIGNATURES)
def test_what_fits_is_passed_with_its_sizes(name: str) -> None:
    recorder, given = Recorder(), fitting(name)
    CheckedFunction(name, recorder, SIGNATURES[name])(given)
    (passed,) = recorder.calls
    pairs = list(zip(passed, SIGNATURES[name], strict=True))
    told = [value for value, one in pairs if isinstance(one, Size)]
    assert told == [SIZES[one.letter] for _, one in pairs if isinstance(one, Size)]
    starts = [v for v, one in pairs if isinstance(one, Array) and one.use != "scratch"]
    assert [ctypes.addressof(start) for start in starts] == [
        one.ctypes.data for one in given if isinstance(one, np.ndarray)
    ]


@pytest.mark.parametrize("name", SIGNATURES)
def test_every_axis_of_every_array_is_checked(name: str) -> None:
    """An entry more along any axis is refused, unless nothing else names that axis' size."""
    letters = [axis for _, one in given_arrays(name) for axis in one.axes]
    for place, array in given_arrays(name):
        for number, axis in enumerate(array.axes):
            if letters.count(axis) == 1 and isinstance(axis, str):
                continue
            given = fitting(name)
            given[place] = np.repeat(given[place], 2, axis=number)
            refused(name, given, ValueError, rf"^kernel {name}: \w+ has shape \(")


@pytest.mark.parametrize("name", SIGNATURES)
def test_arrays_that_lie_otherwise_are_refused(name: str) -> None:
    for place, array in given_arrays(name):
        right = fitting(name)[place]
        spaced = np.repeat(right, 2, axis=-1)[..., ::2]
        locked = right.copy()
        locked.flags.writeable = False
        wrong = [
            (
                np.zeros_like(right, np.float32),
                f"{array.name} is float32, not an array of {array.dtype}",
            ),
            (np.zeros_like(right, ">f8"), f"{array.name} is >f8"),
            (right.tolist(), f"{array.name} is list"),
            (spaced, f"{array.name} is not C-contiguous"),
        ]
        wrong += [(locked, f"{array.name} is read-only")] if array.use == "written" else []
        for other, words in wrong:
            given = fitting(name)
            given[place] = other
            refused(name, given, TypeError, f"^kernel {name}: {words}")


def test_arguments_too_few_or_too_many() -> None:
    given = fitting("axes")
    for wrong in (given[:-1], [*given, given[0]]):
        refused("axes", wrong, TypeError, "kernel axes takes dof_body, axis, rotations, transl")


def test_the_shape_that_was_wanted_is_told() -> None:
    given = fitting("bicubic")
    given[2] = np.zeros((8, 8))
    words = re.escape("coefficients has shape (8, 8), not (F-4, S-4) with F = 12, S = 13")
    refused("bicubic", given, ValueError, words)


def test_signatures_are_those_of_the_c_files() -> None:
    """Same functions, and argument for argument the same names and kinds."""
    folder = Path(compiled.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.c")))
    found = dict(re.findall(r"^EXPORT void (\w+)\(([^)]*)\)", text, re.MULTILINE))
    assert found.keys() == SIGNATURES.keys()
    for name, signature in SIGNATURES.items():
        declared = [re.sub(r"\s+", " ", one).strip() for one in found[name].split(",")]
        assert len(declared) == len(signature), name
        for text, argument in zip(declared, signature, strict=True):
            assert _is_as_declared(argument, text), f"{name}: {text} is {argument}"


def _is_as_declared(argument: Size | Number | Array, text: str) -> bool:
    if isinstance(argument, Size):
        return text.startswith("index_t ") and "*" not in text
    if isinstance(argument, Number):
        return text == f"double {argument.name}"
    entry = "index_t" if argument.dtype == np.int64 else "double"
    const = "const " if argument.use == "read" else ""
    return text == f"{const}{entry} *{argument.name}"


def test_compiled_functions_have_declared_types() -> None:
    if compiled.KERNELS is None:
        pytest.skip("not compiled here")
    for name, function in compiled.KERNELS._functions.items():
        types = [argument.c_type for argument in SIGNATURES[name]]
        assert function._function.argtypes == types
