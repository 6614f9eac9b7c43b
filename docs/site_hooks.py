"""Formulas become MathML while the site is built, and the search finds how-to pages first."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

# What pymdownx.arithmatex leaves of $…$ and $$…$$.
_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
# A wide formula is scrolled by keyboard, too.
_FORMULA = '<div class="formula" tabindex="0" role="group" aria-label="Formula">{}</div>'
_BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
# A thin space after log, min …, which browsers leave out; none before a bracket.
_NAMED = re.compile(r"(<mi>(?:log|min|max|sin|cos|tr|diag|cond|det)</mi>)(?!\s*<mo)")


# How often a word counts in the search, by the folder of its page.
_BOOSTS = {"how-to": 6.0, "decisions": 0.3, "gallery": 0.5}


def on_page_markdown(markdown: str, page: Any, **_: object) -> str:
    """Weigh the page for the search; called by MkDocs."""
    boost = _BOOSTS.get(page.file.src_uri.partition("/")[0])
    if boost is not None:
        page.meta.setdefault("search", {"boost": boost})
    return markdown


def on_page_content(content: str, **_: object) -> str:
    """The page's HTML with every formula as MathML; called by MkDocs."""
    content = _BLOCK.sub(lambda found: _FORMULA.format(_mathml(found, "block")), content)
    return _INLINE.sub(lambda found: _mathml(found, "inline"), content)


def _mathml(found: re.Match[str], display: str) -> str:
    text = convert(html.unescape(found.group(1)).strip(), display=display)
    return _NAMED.sub(r'\1<mspace width="0.17em"/>', text)
