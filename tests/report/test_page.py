"""A page is well-formed, complete in itself, readable without eyes, and trusts no name."""

import re

import pytest

from excite_cli.errors import MissingExtraError
from excite_cli.report.chart import Chart
from excite_cli.report.page import _asset, render
from excite_cli.report.rows_chart import Axis, Bar, Mark, Row, rows_chart
from excite_cli.shown.answer import (
    Charts,
    Choice,
    Command,
    Fold,
    KeyFigure,
    Page,
    Section,
    Table,
    Text,
)
from excite_cli.summary.assembly import Source, page_of
from tests.report.case import Case
from tests.report.structure import Structure

EVIL = "<script>alert('$x_$')</script>\"&"


def _chart(word: str = "torque") -> Chart:
    axis = Axis.about(f"{word} [N·m]", [-1.0, 3.0])
    row = Row(word, (Mark(2.0, word, "blue"),), (Bar(-1.0, 3.0, "muted", word=word),), word)
    return rows_chart(word, f"{word} rises and falls", axis, [row], word, noted=word)


def _page(word: str) -> Page:
    chart = _chart(word)
    blocks = (
        Charts((chart, _chart(word)), word),
        Choice(word, ((word, (chart,)), ("second", (Text(word),)))),
        Table(word, (word, "b"), ((word, "1"),), left=(word,), note=word, folded=True),
        Table("", ("a",), ((word,), ("one\ntwo",)), words=("a",)),
        Command((word,)),
        word,
        Fold(word, (Text(word, "code"), Text(word, "bad"))),
    )
    section = Section("one", word, blocks, word)
    return Page(word, word, (KeyFigure(word, word, word),), (section, Section("two", "B", ())))


@pytest.fixture(scope="module")
def report(case: Case) -> str:
    problem, result = case
    source = Source("smoke", "smoke.h5", result, problem)
    return render(page_of([source], lambda name, done: None))


@pytest.fixture(scope="module", params=["made by hand", "report"])
def page(request: pytest.FixtureRequest, report: str) -> str:
    return report if request.param == "report" else render(_page("torque"))


def test_tags_match_and_addresses_are_unique(page: str) -> None:
    structure = Structure(page)
    identifiers = [a["id"] for _, a in structure.elements if "id" in a]
    assert len(identifiers) == len(set(identifiers))
    referred = {a["href"][1:] for a in structure.all("a")}
    referred |= {a["xlink:href"][1:] for a in structure.all("use")}
    referred |= set(re.findall(r"url\(#([^)]*)\)", page))
    referred |= {a["aria-labelledby"] for _, a in structure.elements if "aria-labelledby" in a}
    assert referred <= set(identifiers)


def test_blocks_of_every_kind_are_drawn() -> None:
    """The template knows kinds by the names of their classes."""
    drawn = render(_page("torque"))
    plain = render(Page("torque", "", (), (Section("one", "torque", ()),)))
    signs = ("<svg", '<div class="grid">', "<table>", "<details>", "<select>", "<pre")
    assert "one<br>two" in drawn
    for sign in signs:
        assert drawn.count(sign) > plain.count(sign), sign


def test_nothing_is_loaded_from_elsewhere(page: str) -> None:
    structure = Structure(page)
    assert [tag for tag, _ in structure.elements if tag in ("link", "iframe", "object")] == []
    for _, attributes in structure.elements:
        for name in ("src", "href", "xlink:href", "srcset", "action"):
            value = attributes.get(name, "")
            assert not value or value.startswith("#")
    assert not re.search(r"@import|url\((?!#)", page)


def test_every_drawing_is_told_in_words(page: str) -> None:
    structure = Structure(page)
    drawings = [a for a in structure.all("div") if a.get("role") == "img"]
    plots = [a for a in drawings if "data-plot" in a]
    assert len(drawings) - len(plots) == len(structure.all("svg")) > 0
    assert all(len(a["aria-label"]) > 10 for a in drawings)


def test_one_style_and_no_colour_of_its_own_in_drawings(page: str) -> None:
    assert len(Structure(page).all("style")) == 1
    for svg in re.findall(r"<svg.*?</svg>", page, re.DOTALL):
        assert "#0a0" not in svg, "a stand-in colour was left"
        assert "var(--" in svg


def test_hostile_names_stay_names() -> None:
    text = render(_page(EVIL))
    structure = Structure(text)
    harmless = Structure(render(_page("elbow")))
    assert len(structure.all("script")) == len(harmless.all("script"))
    assert "<script>alert" not in text
    assert EVIL in "".join(structure.texts)
    assert any(EVIL in a.get("aria-label", "") for a in structure.all("div"))


def test_commands_between_backticks_are_code() -> None:
    blocks = (Text("run `excite <check>` now"), Text("a ` alone"))
    text = render(Page("t", "s", (), (Section("a", "A", blocks),)))
    assert "run <code>excite &lt;check&gt;</code> now" in text
    assert "a ` alone" in text


def test_without_jinja_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "jinja2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[plot\]'"):
        render(Page("t", "s", (), ()))


def test_equal_results_give_equal_pages(case: Case, report: str) -> None:
    problem, result = case
    source = Source("smoke", "smoke.h5", result, problem)
    assert render(page_of([source], lambda name, done: None)) == report


def test_names_of_files_beside_the_page_are_links() -> None:
    table = Table("", ("log", "plan", "n"), (("a b.csv", EVIL, "1"),), files=("log", "plan"))
    text = render(Page("t", "s", (), (Section("a", "A", (table,)),)))
    assert '<a href="a%20b.csv">a b.csv</a>' in text
    links = [a["href"] for a in Structure(text).all("a") if not a["href"].startswith("#")]
    assert len(links) == 2
    assert not any(sign in link for link in links for sign in "<>\"'& ")


def test_what_is_not_for_paper_is_named_there() -> None:
    sections = (Section("a", "First", ("1",)), Section("b", "Second", ("2",), on_paper=False))
    text = render(Page("t", "s", (), sections))
    assert '<section id="b" class="unprinted"' in text
    assert '<section id="a" aria' in text
    assert "Not printed: Second, folded parts." in text


def test_a_verdict_is_a_class_and_a_figure_leads_to_its_section() -> None:
    figure = KeyFigure("error", "1 %", "small\nand sure", "good", "a")
    text = render(Page("t", "s", (figure, KeyFigure("n", "2")), (Section("a", "A", ("1",)),)))
    assert '<div class="good"><dt><a href="#a">error</a></dt>' in text
    assert "small<br>and sure" in text
    assert '<div class="plain"><dt>n</dt>' in text


def _luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", ["light", "dark", "print"])
def test_texts_and_lines_have_the_contrast_of_aa(theme: str) -> None:
    """Texts 4.5 : 1 and signs 3 : 1 against every ground that they stand on."""
    style = _asset("page.css")
    begin = {"light": ":root {", "dark": ':root[data-theme="dark"] {', "print": "@media print {"}
    rules = style[style.index(begin[theme]) :].partition("}")[0]
    colours = {name: _whole(value) for name, value in re.findall(r"--(\w+): (#\w+)", rules)}
    ink = ("ink", "muted", "accent") if theme != "print" else ("ink", "muted")
    signs = ("blue", "vermilion", "green", "amber", "purple", "limit")
    for names, least, grounds in (
        (ink, 4.5, ("paper", "card", "shaded")),
        (signs, 3.0, ("paper", "card", "shaded", "forbidden")),
    ):
        for name in names:
            for ground in grounds:
                high, low = sorted((_luminance(colours[name]), _luminance(colours[ground])))[::-1]
                assert (high + 0.05) / (low + 0.05) >= least, f"{name} on {ground}"


def _whole(colour: str) -> str:
    return colour if len(colour) == 7 else "#" + "".join(2 * digit for digit in colour[1:])
