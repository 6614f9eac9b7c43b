"""Names in comments of C: nothing in them ends a comment, begins one or joins two lines."""

import re

_PAIRS = re.compile(r"\*(?=/)|/(?=\*)|\?(?=\?)")  # ends, beginnings, trigraphs


def in_comment(words: str) -> str:
    """`words` with spaces in pairs that C reads, and `<U+000A>` for what has no glyph of its own.

    So is a backslash, which joins lines, and a sign that turns the direction of a text round.
    """
    spaced = _PAIRS.sub(lambda pair: f"{pair.group()} ", words).replace("@", "(at)")
    return "".join(
        each if each.isprintable() and each != "\\" else f"<U+{ord(each):04X}>" for each in spaced
    )
