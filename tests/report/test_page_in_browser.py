"""The page of a small campaign in a real browser: nothing fails, nothing overflows, all reacts."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from excite_cli.report.page import render
from excite_cli.summary.assembly import Source, page_of
from tests.browser import started_browser
from tests.report.case import Case

_OVERFLOW = "document.documentElement.scrollWidth - innerWidth"


@pytest.fixture(scope="module")
def address(case: Case, tmp_path_factory: pytest.TempPathFactory) -> str:
    problem, result = case
    second = replace(result.motions[0], index=2)
    two = replace(result, motions=(*result.motions, second))
    source = Source("smoke", "smoke.h5", two, problem)
    path: Path = tmp_path_factory.mktemp("page") / "smoke.html"
    path.write_text(render(page_of([source], lambda name, done: None)), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with started_browser() as started:
        yield started


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    """The page, on a desk; whatever the browser complains of fails the test."""
    complaints: list[str] = []
    opened = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme="light")
    opened.on("console", lambda message: complaints.append(message.text))
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.on("request", lambda r: complaints.append(r.url) if r.url != address else None)
    opened.goto(address)
    yield opened
    opened.close()
    assert complaints == []


@pytest.mark.long
@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_is_wider_than_the_window(page: Any, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 850})
    for part in page.query_selector_all("summary"):
        if part.is_visible():
            part.click()
    assert page.evaluate(_OVERFLOW) <= 0


def test_it_is_there_at_once(page: Any) -> None:
    timing = "performance.getEntriesByType('navigation')[0]"
    # Generous: a busy machine with one core. By itself it is a few tenths of a second.
    assert page.evaluate(f"{timing}.loadEventEnd - {timing}.responseEnd") < 5000


def test_drawings_have_lines_and_plots_axes_with_units(page: Any) -> None:
    drawings = page.evaluate(
        """() => [...document.querySelectorAll(".chart:has(svg)")].map(
             (chart) => chart.querySelectorAll("svg path").length)"""
    )
    assert len(drawings) == 1  # the robot
    assert drawings[0] > 5
    plots = page.evaluate(
        """() => [...document.querySelectorAll(".plot")].map(
             (plot) => JSON.parse(plot.dataset.plot))"""
    )
    for plot in plots:
        for axis in (plot["axis"], *(panel["axis"] for panel in plot["panels"])):
            assert axis.endswith("]"), axis


def test_logarithmic_axes_show_what_is_there(page: Any) -> None:
    plot = page.locator("#condition .plot").first
    plot.scroll_into_view_if_needed()
    plot.locator("canvas").first.wait_for()
    shown = plot.evaluate(
        """(holder) => { const [plot] = holder.plots, {min, max} = plot.scales.y;
             return [min, max, plot.data.slice(1).flat().filter((y) => y != null)]; }"""
    )
    low, high, values = shown
    assert 0 < low < min(values)
    assert max(values) < high < 2 * max(values)


def shown(page: Any, number: int) -> Any:
    """A chart of the first motion that is in sight, and drawn."""
    plot = page.locator("#motions .plot:visible").nth(number)
    plot.scroll_into_view_if_needed()
    plot.locator("canvas").first.wait_for()
    return plot


def test_plots_are_drawn_when_they_come_into_sight(page: Any) -> None:
    assert page.locator(".plot").count() == 2 + 2 * 5 + 2 * 5
    plot = shown(page, 0)
    ink = plot.locator("canvas").first.evaluate(
        """(canvas) => new Set(new Uint32Array(canvas.getContext("2d").getImageData(
             0, 0, canvas.width, canvas.height).data.buffer)).size"""
    )
    assert ink > 20  # paper, shades of lines, axes and forbidden ground


def test_charts_of_a_motion_are_zoomed_together(page: Any) -> None:
    first, second = shown(page, 0), shown(page, 1)
    before = [plot.locator("canvas").first.screenshot() for plot in (first, second)]
    box = first.locator(".u-over").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.3 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=4)
    page.mouse.up()
    page.mouse.move(0, 0)
    zoomed = [plot.locator("canvas").first.screenshot() for plot in (first, second)]
    assert all(one != two for one, two in zip(before, zoomed, strict=True))
    first.focus()
    page.keyboard.press("Escape")
    again = [plot.locator("canvas").first.screenshot() for plot in (first, second)]
    assert again == before


def test_keys_move_the_cursor_and_values_are_spoken(page: Any) -> None:
    shown(page, 0).focus()
    page.keyboard.press("ArrowRight")
    said = page.locator("#spoken").inner_text()
    assert "position " in said
    assert " rad" in said
    page.keyboard.press("Shift+ArrowRight")
    assert page.locator("#spoken").inner_text() != said


def test_one_motion_is_shown_and_another_can_be_chosen(page: Any) -> None:
    assert page.locator(".choice").count() == 2
    for choice in page.locator(".choice").all():
        first, second = choice.locator(":scope > .option").all()
        assert (first.is_visible(), second.is_visible()) == (True, False)
        choice.locator("select").select_option(label="motion 2")
        assert (first.is_visible(), second.is_visible()) == (False, True)


def test_light_and_dark_change_paper_and_lines(page: Any) -> None:
    colours = """() => [
      getComputedStyle(document.body).backgroundColor,
      getComputedStyle(document.querySelector(".chart svg path")).stroke]"""
    light = page.evaluate(colours)
    page.click("#theme")
    dark = page.evaluate(colours)
    assert light[0] != dark[0]
    assert light[1] != dark[1]
    page.click("#theme")
    assert page.evaluate(colours) == light


def test_folds_open(page: Any) -> None:
    fold = page.locator("details", has_text="The config, with all defaults")
    assert not fold.locator("pre").is_visible()
    fold.locator("summary").focus()
    page.keyboard.press("Enter")
    assert "smoke_arm.urdf" in fold.locator("pre").inner_text()


def test_values_are_read_under_the_pointer(page: Any) -> None:
    plot = shown(page, 2)
    box = plot.locator(".u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.4 * box["height"])
    values = plot.locator(".u-series:visible .u-value").all_inner_texts()
    assert len(values) == 2 + 3  # time and position; time, speed and acceleration
    assert all(any(letter.isdigit() for letter in value) for value in values)
    other = page.locator("#motions .plot:visible").nth(1).locator(".u-series:visible .u-value")
    assert other.all_inner_texts()[1] == values[1]  # the cursor is shared
    page.mouse.move(0, 0)


def test_on_paper_the_chosen_motion_is_printed_and_no_button(page: Any) -> None:
    page.emulate_media(media="print")
    for choice in page.locator(".choice").all():
        first, second = choice.locator(":scope > .option").all()
        assert (first.is_visible(), second.is_visible()) == (True, False)
    assert not page.locator("#theme").is_visible()
    assert not page.locator("nav").is_visible()
    for plot in page.locator(".option:not([hidden]) .plot").all():
        plot.locator("canvas").first.wait_for(state="attached")
        assert plot.locator("canvas").count() == 2 or plot.locator("canvas").count() == 1
