"""Text of C files: templates with gaps, and rows of numbers."""

import re
from collections.abc import Mapping

import numpy as np

from excite_cli.effects.mechanism import reals
from excite_cli.robot.model import Array


def filled(text: str, gaps: Mapping[str, str]) -> str:
    """The text with its gaps `@NAME@` filled, in one pass: what is put in may look like a gap."""
    places = "|".join(re.escape(name) for name in gaps)
    return re.sub(f"@({places})@", lambda found: gaps[found[1]], text)


def wrapped(x: Array) -> str:
    """All numbers of `x`, a row (of its last axis) a line."""
    return "\n    " + ",\n    ".join(reals(row) for row in np.atleast_2d(x))


def braced(rows: Array) -> str:
    """`{…},` for every row of `rows`."""
    return ",\n".join(f"    {{{reals(row)}}}" for row in rows)
