"""The documentation is built with warnings as errors, and needs nothing from elsewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser import started_browser
from tests.cli.program import ROOT

# What a page would load by itself; links that a reader may follow are none of it.
_LOADED = re.compile(r"<(?:script|img|link|iframe|source)\b[^>]*?\b(?:src|href)=[\"']?([^\"'\s>]+)")
_CODE = re.compile(r"<(pre|code|script|math)\b.*?</\1>", re.DOTALL)
_TEXT = re.compile(r"<(p|li|td|dd)\b[^>]*>(.*?)</\1>", re.DOTALL)
_TAG = re.compile(r"<[^>]+>")
# The beginning of an item, emphasis, code, a link, a row of a table.
_MARK = re.compile(r"(?:^|\n)\s*(?:[-*+]|\d+[.)]) |\*\*|`|\]\(|\n\|.*\|")
_STYLE = re.compile(r"""(?:url\(|@import\s+)["']?(https?:)?//""")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs")
    target = tmp_path_factory.mktemp("site")
    run = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(target)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return target


def test_pages_load_nothing_from_elsewhere(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        text = page.read_text(encoding="utf-8")
        outside = [
            found for found in _LOADED.findall(text) if found.startswith(("http:", "https:", "//"))
        ]
        assert not outside, f"{page.name} loads {outside}"
    for style in site.rglob("*.css"):
        assert not _STYLE.search(style.read_text(encoding="utf-8")), style.name


def test_no_mark_of_markdown_is_left(site: Path) -> None:
    """Lists need a blank line before them, emphasis and code their closing marks."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        article = text[text.find("<article") : text.find("</article>")]
        shown = _CODE.sub("", article)
        for _, inner in _TEXT.findall(shown):
            words = _TAG.sub("", inner)
            left = _MARK.search(words)
            assert left is None, f"{page.name}: {words[: left.end() + 60]!r}"
    effects = (site / "effects.html").read_text(encoding="utf-8")
    assert effects.count("<li><strong>Seen as</strong>") > 20


def test_formulas_are_mathml(site: Path) -> None:
    text = (site / "criteria.html").read_text(encoding="utf-8")
    assert text.count("<math") > 15
    assert 'class="arithmatex"' not in text
    for page in site.rglob("*.html"):
        assert "\\frac" not in page.read_text(encoding="utf-8").partition("<footer")[0], page.name


def test_the_search_works_from_a_folder(site: Path) -> None:
    """Opened as files, with nothing fetched: a word leads to its page, and the link is good."""
    with started_browser() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(20_000)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto((site / "how-to" / "data.html").as_uri())
        page.click("input.md-search__input")
        page.keyboard.type("stribeck")
        link = page.wait_for_selector("a.md-search-result__link[href*='effects.html']")
        assert link is not None
        link.click()
        page.wait_for_url(re.compile(r"effects\.html"))
        assert "Stribeck friction" in page.inner_text("article")
        assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def test_public_functions_are_in_the_reference(site: Path) -> None:
    text = (site / "library.html").read_text(encoding="utf-8")
    for name in (
        "loading.load_problem", "planning.plan", "diagnosing.diagnose", "identifying.identify",
        "simulating.simulate", "checking.check", "reporting.write_report", "viewing.view_motions",
        "viewing.draw_motion", "exporting.export_file",
    ):  # fmt: skip
        assert f'id="excite_cli.api.{name}"' in text
