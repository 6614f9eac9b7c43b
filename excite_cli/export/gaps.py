"""Filling the gaps of a template, `@NAME@`."""

import re
from collections.abc import Mapping


def filled(text: str, gaps: Mapping[str, str]) -> str:
    """The text with its gaps filled, in one pass: what is put in may look like a gap."""
    places = "|".join(re.escape(name) for name in gaps)
    return re.sub(f"@({places})@", lambda found: gaps[found[1]], text)
