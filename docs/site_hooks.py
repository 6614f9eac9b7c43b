"""Formulas become MathML while the site is built: no script, no fonts to load."""

import html
import re

from latex2mathml.converter import convert

# What pymdownx.arithmatex leaves of $…$ and $$…$$.
_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
# A thin space after log, min …, which browsers leave out; none before a bracket.
_NAMED = re.compile(r"(<mi>(?:log|min|max|sin|cos|tr|diag|cond|det)</mi>)(?!\s*<mo)")


def on_page_content(content: str, **_: object) -> str:
    """The page's HTML with every formula as MathML; called by MkDocs."""
    content = _BLOCK.sub(
        lambda found: f'<div class="formula">{_mathml(found, "block")}</div>', content
    )
    return _INLINE.sub(lambda found: _mathml(found, "inline"), content)


def _mathml(found: re.Match[str], display: str) -> str:
    text = convert(html.unescape(found.group(1)).strip(), display=display)
    return _NAMED.sub(r'\1<mspace width="0.17em"/>', text)
