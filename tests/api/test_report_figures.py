"""The files of a report stand in the order of the loop."""

from pathlib import Path
from typing import Any

import pytest

from excite_cli.api.report_figures import ReportedFile, in_order
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_model import StoredFit


def motions(*priors: str) -> Result:
    """Made on top of `priors`; nothing else is asked of them."""
    found = object.__new__(Result)
    object.__setattr__(found, "priors", priors)
    return found


def _ordered(*files: tuple[str, Any]) -> list[str]:
    told = [ReportedFile(Path("here") / name, Path(name).stem, content) for name, content in files]
    return [each.path.name for each in in_order(told)]


def test_motions_then_fits_then_diagnoses_then_what_follows() -> None:
    assert _ordered(
        ("next.h5", motions("elsewhere/diagnosis.h5")),
        ("diagnosis.h5", object.__new__(Diagnosis)),
        ("fit.h5", object.__new__(StoredFit)),
        ("more.h5", motions("first.h5")),
        ("first.h5", motions()),
    ) == ["first.h5", "more.h5", "fit.h5", "diagnosis.h5", "next.h5"]


@pytest.mark.parametrize(
    ("of_b", "of_a", "ordered"),
    [
        ((), (), ["b.h5", "a.h5"]),  # as given, where nothing else decides
        (("b.h5",), (), ["b.h5", "a.h5"]),  # its own prior
        (("missing.h5",), (), ["b.h5", "a.h5"]),
        (("a.h5",), ("b.h5",), ["b.h5", "a.h5"]),  # a circle ends
        (("a.h5",), (), ["a.h5", "b.h5"]),
    ],
)
def test_what_is_built_upon_comes_first(
    of_b: tuple[str, ...], of_a: tuple[str, ...], ordered: list[str]
) -> None:
    assert _ordered(("b.h5", motions(*of_b)), ("a.h5", motions(*of_a))) == ordered
