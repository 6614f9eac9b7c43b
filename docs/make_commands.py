"""Writes docs/commands.md from the commands themselves.

Run: python -m docs.make_commands
"""

from pathlib import Path
from typing import Any

import typer

from excite_cli.cli.app import app
from excite_cli.cli.help_page import sections_of, usage_of

TARGET = Path(__file__).parent / "commands.md"
HEAD = """# Every command and option

Made by `python -m docs.make_commands` from the program's own help; a test keeps it up to date. At a
terminal `excite COMMAND --help` says the same.

Answers go to stdout (`--json`: for programs, see [Files and JSON](files.md)), progress and messages
to stderr. What is done, and how long it will take at most, stands in a line at the bottom of a
terminal; in a log it is written after two seconds and then every ten (`--no-progress`: neither).
At the end stands what to do next (`next` in JSON, command lines; `--quiet` leaves it out).

| exit status | means |
|---|---|
| 0 | good |
| 1 | it ran, and the answer is bad: no admissible motion, a limit broken, a wrong gradient,\
 effects that do not lower the error on held-out data |
| 2 | bad input: a file, a config, an option |
| 70 | a bug in excite |
| 130 | interrupted |
"""


def commands() -> str:
    """The page as Markdown."""
    program: Any = typer.main.get_command(app)
    groups: dict[str, list[str]] = {}
    for name, command in program.commands.items():
        groups.setdefault(command.rich_help_panel or "Others", []).append(name)
    parts = [HEAD]
    for title, names in groups.items():
        parts.append(f"\n**{title}**\n")
        parts += [f"- [`{name}`](#{name}): {_summary(program.commands[name])}" for name in names]
    for name, command in program.commands.items():
        parts += _page(name, command)
    return "\n".join(parts) + "\n"


def _summary(command: Any) -> str:
    return str(command.help or "").partition("\n\n")[0]


def _page(name: str, command: Any) -> list[str]:
    context = typer.Context(command, info_name=f"excite {name}")
    parts = [f"\n## {name}\n", _escaped(command.help or "")]
    parts.append(f"\n```text\n{usage_of(command, context)}\n```\n")
    if command.epilog:
        # Not `console`: these are forms to fill in, not runs with files at hand.
        parts.append(f"Examples:\n\n```text\n{command.epilog}\n```\n")
    for title, rows in sections_of(command, context).items():
        parts.append(f"{title}:\n")
        parts += [f"- `{names}`<br>{_escaped(words)}" for names, words in rows]
        parts.append("")
    return parts


def _escaped(text: str) -> str:
    """Safe for Markdown: brackets that look like tags or links, but for those in backticks."""
    parts = str(text).split("`")
    for at in range(0, len(parts), 2):
        parts[at] = parts[at].replace("<", "&lt;").replace(">", "&gt;").replace("[", "\\[")
    return "`".join(parts)


if __name__ == "__main__":
    TARGET.write_text(commands(), encoding="utf-8")
