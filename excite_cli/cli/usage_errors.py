"""Typer's own errors (mistyped commands and options, missing arguments) in our words.

Each becomes one `ConfigError`, so that it looks and ends like every other bad input.
"""

import os
import shlex
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from excite_cli.api.showing import as_word
from excite_cli.cli.help_page import usage_of
from excite_cli.errors import ConfigError, nearest

# Names that begin with a minus, which a command line takes for options, and `--`.
#
# What stands after `--` is always a name; options are then given before it.

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


# Typer brings its own copy of click in some versions: take the base from one of its errors.
USAGE_ERROR: type[Exception] = next(
    c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException"
)


def in_our_words(error: Exception, words: list[str], commands: Iterable[str]) -> ConfigError | None:
    """What is wrong, where, and what was meant; None for a page of help that was requested."""
    if type(error).__name__ == "NoArgsIsHelpError":
        return None
    mistyped = _mistyped_command(error, words, list(commands))
    if mistyped is not None:
        return mistyped
    context: Any = getattr(error, "ctx", None)
    param: Any = getattr(error, "param", None)
    reason = str(getattr(error, "message", error)).strip().rstrip(".")
    path = context.command_path if context is not None else "excite"
    where = f"{path}: "
    usage = f" Usage: {usage_of(context.command, context)}" if context is not None else ""
    more = f" `{path} --help` says more."
    kind = type(error).__name__
    if kind == "NoSuchOption" and context is not None:
        given = str(getattr(error, "option_name", ""))
        known = [name for each in context.command.get_params(context) for name in _names(each)]
        taken = about_names(words, context, given)
        advice = f"{nearest(given, known)}{taken or more}"
        return ConfigError(f"{where}there is no option {given}.{advice}")
    if kind == "MissingParameter":
        taken = about_names(words, context)
        return ConfigError(f"{where}{_called(param)} is missing.{taken}{usage}")
    if kind == "BadParameter":
        reason = reason[:1].lower() + reason[1:]
        return ConfigError(f"{where}{_called(param)}: {reason.partition(', unable')[0]}.{more}")
    if kind == "BadOptionUsage":
        return ConfigError(
            f"{where}{getattr(error, 'option_name', 'an option')} needs a value.{more}"
        )
    if "unexpected extra argument" in reason:
        extra = reason.rpartition("(")[2].rstrip(")")
        if path.endswith(" init"):  # the one command whose robot is an option
            one = shlex.quote(extra) if extra in words else "NAME"  # several are told as one text
            usage = f" Did you mean --robot {one}, or --urdf {one}?"
        return ConfigError(f"{where}unexpected: {extra}.{about_names(words, context)}{usage}")
    return ConfigError(f"{where}{reason[:1].lower()}{reason[1:]}.{more}")


def _mistyped_command(
    error: Exception, words: list[str], commands: list[str]
) -> ConfigError | None:
    """A helpful error when the first word is no command, else None."""
    word = next((word for word in words if not word.startswith("-")), None)
    if word is None or word in commands or "ommand" not in str(error):
        return None
    return ConfigError(
        f"there is no command '{word}'.{nearest(word, commands)} Commands: {', '.join(commands)}."
    )


def _names(param: Any) -> list[str]:
    return [name for name in (*param.opts, *param.secondary_opts) if name.startswith("--")]


def _called(param: Any) -> str:
    """What a person calls a parameter: `CONFIG`, `--format`."""
    if param is None:
        return "a value"
    if param.param_type_name == "argument":
        return str(param.metavar or param.name).upper()
    return max(param.opts, key=len)
