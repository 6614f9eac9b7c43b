"""Reports from Python."""

from pathlib import Path
from typing import Any

import pytest

from excite_cli import ConfigError, FileError, write_diagnosis, write_report
from excite_cli.api.reporting import ReportedFile, in_order
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_model import StoredFit
from tests.api.conftest import SMOKE, Loop
from tests.diagnosis.synthetic_diagnosis import make_diagnosis


def test_what_is_no_report_is_one_sentence(loop: Loop, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    for given, words in (
        (loop.data, r"data\.h5 holds measured data.*A report is made of results"),
        (str(SMOKE), r"smoke\.yaml.*A report is made of results"),
        ([], "nothing to report"),
        ([loop.fit, str(loop.fit)], "is given twice"),
    ):
        with pytest.raises(FileError, match=words):
            write_report(given, page)
    with pytest.raises(ConfigError, match=r"--format gif: unknown\. Known: png, svg, pdf"):
        write_report(loop.result, figures=tmp_path, format="gif")
    with pytest.raises(FileError, match="draws motions and diagnoses, and none was given"):
        write_report(loop.fit, figures=tmp_path)
    assert not list(tmp_path.iterdir())


def test_figures_of_diagnoses_have_the_names_of_their_files(tmp_path: Path) -> None:
    for name in ("one", "other"):
        write_diagnosis(tmp_path / f"{name}.h5", make_diagnosis())
    folder = tmp_path / "figures"
    alone = write_report(tmp_path / "one.h5", figures=folder, format="svg").figures
    assert alone == (folder / "errors.svg",)
    both = [tmp_path / "one.h5", tmp_path / "other.h5"]
    written = write_report(both, figures=folder, format="pdf").figures
    assert [path.name for path in written] == ["one_errors.pdf", "other_errors.pdf"]
    assert all(path.read_bytes().startswith(b"%PDF") for path in written)


def test_a_page_of_a_fit(loop: Loop, tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    found = write_report(
        [str(loop.fit)],
        tmp_path / "page.html",
        progress=lambda text, done, total: told.append((text, done, total)),
    )
    assert found.page == tmp_path / "page.html"
    assert found.figures == ()
    assert "Made by excite from fit.h5" in found.page.read_text(encoding="utf-8")
    assert told == [("fit", 0, 1)]
    with pytest.raises(FileError, match="exists already"):
        write_report(loop.fit, str(found.page))


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
