"""Every relative link of the README and the documentation leads to what is there."""

import re
from pathlib import Path

import pytest

from tests.cli.program import ROOT

PAGES = [*ROOT.glob("*.md"), *sorted((ROOT / "docs").rglob("*.md"))]
_CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)
_LINK = re.compile(r"(?<!\\)\]\(([^)\s]+)\)|<(?:img|a)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")
_OUTSIDE = re.compile(r"[a-z]+:")


def broken(page: Path) -> list[str]:
    """Links of a page whose file is missing, or whose heading is not in the page it leads to."""
    text = _CODE.sub("", page.read_text(encoding="utf-8"))
    wrong = []
    for pair in _LINK.findall(text):
        link = pair[0] or pair[1]
        if _OUTSIDE.match(link):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            wrong.append(link)
    return wrong


def anchors(page: Path) -> set[str]:
    """As GitHub and MkDocs make them of headings; of letters, digits and hyphens alone."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {
        re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", each).strip().lower()) for each in headings
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    assert broken(page) == []


def test_a_broken_link_is_noticed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    (tmp_path / "there.md").write_text("# A (good) heading\n", encoding="utf-8")
    page.write_text(
        "# Top\n[a](there.md) [b](none.md) ![c](none.png) `[d](code.md)` [e](https://x.y/z)\n"
        '[f](there.md#a-good-heading) [g](there.md#bad) [h](#top) <img src="none.svg">\n',
        encoding="utf-8",
    )
    assert broken(page) == ["none.md", "none.png", "there.md#bad", "none.svg"]
