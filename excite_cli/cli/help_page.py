"""How `--help` looks: summary, examples to copy, arguments, options in groups.

Without boxes, so that it reads the same at 80 columns, in a pager and in a pipe. Examples stand in
the docstring of a command, after `Example:` or `Examples:`; where they are too long for a terminal,
their lines end in a backslash, so that they can be copied.
"""

import inspect
import os
import re
import textwrap
from enum import Enum
from typing import Any, get_args

from typer.core import TyperCommand, TyperGroup

from excite_cli.api import names as offered
from excite_cli.cli.layout import copyable, wrapped

# Groups of options are reported in this order; those of no group come first, as "Options".
WORK, OUTPUT, MESSAGES = "Workers", "Output files", "Messages"
_LAST = (WORK, OUTPUT, MESSAGES)
_INDENT, _FARTHER = 2, 6
_NARROWEST, _WIDEST_NAMES = 50, 26
_FAMILY = re.compile(r"\{(readers|motion_formats)\}")
_BOLD, _PLAIN = "\x1b[1m", "\x1b[0m"
_METAVARS = {"path": "FILE", "int": "N", "float": "X", "text": "TEXT", "str": "TEXT"}


def split_docstring(docstring: str) -> tuple[str, str]:
    """The words, each paragraph on one line, and the examples as they are written."""
    words, examples = [], []
    for paragraph in inspect.cleandoc(docstring).split("\n\n"):
        head, colon, rest = paragraph.partition(":")
        if colon and head in ("Example", "Examples"):
            examples.append(textwrap.dedent(rest.strip("\n")).strip())
        else:
            words.append(" ".join(paragraph.split("\n")))
    return "\n\n".join(words), "\n".join(examples)


class HelpfulCommand(TyperCommand):
    """A command with a page of help that can be read and copied from."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page."""
        write_page(self, ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Options, each with its words."""
        for param in self.get_params(ctx):
            if param.param_type_name == "option":
                param.help = words_of(param)  # type: ignore[attr-defined]
        return super().shell_complete(ctx, incomplete)


class HelpfulGroup(TyperGroup):
    """The program itself: its commands in groups."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page."""
        write_page(self, ctx, formatter)


def words_of(param: Any) -> str:
    """The help of an option or argument, with the members of a family where it has `{readers}`."""
    return _FAMILY.sub(lambda found: ", ".join(getattr(offered, found[1])()), str(param.help or ""))


def usage_of(command: Any, ctx: Any) -> str:
    """`excite check CONFIG FILE [OPTIONS]`, with the options that must be given."""
    arguments = [_argument(p) for p in command.params if p.param_type_name == "argument"]
    commands = ["COMMAND"] if hasattr(command, "commands") else []
    options = [p for p in command.params if p.param_type_name == "option" and p.required]
    needed = [f"{max(p.opts, key=len)} {_metavar(p, ctx)}" for p in options]
    return " ".join([ctx.command_path, *commands, *arguments, *needed, "[OPTIONS]"])


def write_page(command: Any, ctx: Any, formatter: Any) -> None:
    """The whole page of help, for a terminal of the formatter's width."""
    width = max(formatter.width, _NARROWEST)
    formatter.write(f"{_heading('Usage')} {usage_of(command, ctx)}\n")
    for paragraph in (command.help or "").split("\n\n"):
        formatter.write("\n" + _filled(paragraph, width))
    if command.epilog:
        examples = re.sub(r" *\\\n *", " ", command.epilog).splitlines()
        lines = (copyable(" " * _INDENT + example, width) for example in examples)
        formatter.write(f"\n{_heading('Examples')}\n" + "\n".join(lines) + "\n")
    for title, rows in sections_of(command, ctx).items():
        formatter.write(f"\n{_heading(title)}\n" + _rows(rows, width))


def _heading(title: str) -> str:
    """Bold on a terminal; typer takes the marks away elsewhere."""
    plain = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
    return f"{title}:" if plain else f"{_BOLD}{title}:{_PLAIN}"


def sections_of(command: Any, ctx: Any) -> dict[str, list[tuple[str, str]]]:
    """Commands by group, arguments, options by group: name and words of each."""
    found: dict[str, list[tuple[str, str]]] = {}
    for name, inner in getattr(command, "commands", {}).items():
        title = getattr(inner, "rich_help_panel", None) or "Commands"
        found.setdefault(str(title), []).append((name, (inner.help or "").split("\n\n")[0]))
    options: dict[str, list[tuple[str, str]]] = {"Options": []}
    options.update({title: [] for title in _LAST})
    for param in command.get_params(ctx):
        if getattr(param, "hidden", False):
            continue
        if param.param_type_name == "argument":
            row = (_argument(param), words_of(param))
            found.setdefault("Arguments", []).append(row)
        else:
            own = getattr(param, "rich_help_panel", None) or "Options"
            alone = param.name == "help" and not hasattr(command, "commands")
            options.setdefault(MESSAGES if alone else str(own), []).append(_option(param, ctx))
    last = {title: options.pop(title) for title in _LAST}
    return {**found, **{title: rows for title, rows in {**options, **last}.items() if rows}}


def _argument(param: Any) -> str:
    name = str(param.metavar or param.name).upper()
    name = name.rstrip("…") + "…" * (param.nargs != 1)
    return name if param.required else f"[{name}]"


def _option(param: Any, ctx: Any) -> tuple[str, str]:
    """`-o, --output FILE`, and the words beside it with default and whether it must be given."""
    names = ", ".join(sorted(param.opts, key=len))
    if param.secondary_opts:
        names += f" / {', '.join(param.secondary_opts)}"
    if not param.is_flag:
        names += f" {_metavar(param, ctx)}"
    words = words_of(param).rstrip()
    default = param.default
    if param.required:
        words += " Must be given."
    elif not (default is None or isinstance(default, bool | tuple | list) or callable(default)):
        shown = f"{default:g}" if isinstance(default, float) else getattr(default, "value", default)
        words += f" Default: {shown}."
    return names, words.strip()


def _metavar(param: Any, ctx: Any) -> str:
    """`FILE`, `N`, `png|svg`: what stands after an option's name."""
    if param.metavar:
        return str(param.metavar)
    described = getattr(param, "type_descriptor", None)
    if described is None:  # typer on click: the type knows its own name
        choices = getattr(param.type, "choices", None)
        kind = str(param.type.name).removesuffix(" range").replace("integer", "int")
        return "|".join(map(str, choices)) if choices else _METAVARS.get(kind, kind.upper())
    kinds = [each for each in _plain_types(described.annotation) if each is not type(None)]
    if kinds and issubclass(kinds[0], Enum):
        return "|".join(str(each.value) for each in kinds[0])
    return _METAVARS.get(kinds[0].__name__.lower(), "TEXT") if kinds else "TEXT"


def _plain_types(annotation: Any) -> list[type]:
    """The classes in `Annotated[list[Path] | None, …]`."""
    inner = get_args(annotation)
    if not inner:
        return [annotation] if isinstance(annotation, type) else []
    return [each for part in inner for each in _plain_types(part)]


def _filled(text: str, width: int, indent: int = _INDENT) -> str:
    return textwrap.indent(wrapped(text, width - indent), " " * indent) + "\n"


def _rows(rows: list[tuple[str, str]], width: int) -> str:
    """Two columns; a name too long for the first one has a line of its own.

    So has one whose words hold a longer word than there is room for beside it.
    """
    names = [len(name) for name, _ in rows if len(name) <= _WIDEST_NAMES]
    column = _INDENT + max(names, default=_WIDEST_NAMES) + 2
    text = ""
    for name, words in rows:
        first = " " * _INDENT + name
        longest = max(map(len, words.split()), default=0)
        beside = column if longest <= width - column else _FARTHER
        lines = wrapped(words, width - beside).splitlines()
        if not lines or len(first) + 2 > beside:
            text += first + "\n"
        else:
            text += first.ljust(column) + lines.pop(0) + "\n"
        text += "".join(" " * beside + line + "\n" for line in lines)
    return text
