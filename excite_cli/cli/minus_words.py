"""Names that begin with a minus, which a command line takes for options, and `--`.

What stands after `--` is always a name; options are then given before it.
"""

import os
from collections.abc import Sequence
from typing import Any

from excite_cli.api.showing import as_word

_END = "--"


def about_names(words: Sequence[str], context: Any, wrong: str = "") -> str:
    """A sentence about a name of `words` that was taken for an option, or the other way round.

    `wrong` is the option that there is not. Empty where there is nothing to say.
    """
    options = _taking_values(context)
    end = list(words).index(_END) if _END in words else len(words)
    for word in words[end + 1 :]:
        if word.split("=")[0] in options:
            return f" What stands after `--` is taken for a name: put {word} before it."
    for before, word in zip(("", *words), words[:end], strict=False):
        value = options.get(before, False)
        if word.startswith("-") and not value and (os.path.lexists(word) or _led_to(wrong, word)):
            return (
                f" '{word}' begins with a minus, so it is taken for options: give a file of that "
                f"name as {as_word(word)}, or all names after `--`."
            )
    return ""


def _led_to(wrong: str, word: str) -> bool:
    """Whether a word of several letters was read as single options, one of which there is not."""
    return bool(wrong) and not word.startswith("--") and len(word) > 2 and wrong[1:] in word


def _taking_values(context: Any) -> dict[str, bool]:
    """Every spelling of an option of the command, and whether a value follows it."""
    params = [] if context is None else context.command.get_params(context)
    return {
        name: not getattr(param, "is_flag", False)
        for param in params
        if param.param_type_name == "option"
        for name in (*param.opts, *param.secondary_opts)
    }
