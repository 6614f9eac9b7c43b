"""Texts for users have none of the banned words: every literal of the program is read."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import excite_cli

ROOT = Path(excite_cli.__file__).parent
COMMANDS = ROOT / "cli"

# `rest` is residual or remainder; a robot may stand at rest, start from rest and end at rest.
BANNED = re.compile(
    r"\b(told|tells?|(?<!at )(?<!from )(?<!to )rests?|sealed|takes? off|taken off|at hand|nobody"
    r"|whoever|whatever|apart|settles?|settled|weighed|trifles?|suspects?|stays)\b",
    re.IGNORECASE,
)
# Names in code and files, and texts that files of earlier versions have.
ALLOWED = {
    ("cli/app.py", "sealed"),
    ("diagnosis/verdict.py", "rests on what was weighed"),
    ("geometry/pair_choice_cache.py", "apart"),
    ("robot/formats/kept_meshes.py", "rest"),
    ("workers/at_hand.py", "workers at hand"),
    ("workers/child.py", "told"),
    ("workers/processes.py", "told"),
}


def texts(source: str, command: bool = False) -> Iterator[tuple[int, str]]:
    """Literals with their lines; docstrings are help texts where functions are commands."""
    tree = ast.parse(source)
    docstrings = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        first = node.body[0] if node.body else None
        helps = command and isinstance(node, ast.FunctionDef) and not node.decorator_list
        if isinstance(first, ast.Expr) and not (helps and node.name[0] != "_"):
            docstrings.add(id(first.value))
    for node in ast.walk(tree):
        text: object = node.value if isinstance(node, ast.Constant) else None
        if isinstance(text, str) and id(node) not in docstrings:
            yield node.lineno, " ".join(text.split())


def banned(name: str, source: str, command: bool = False) -> list[str]:
    """`name:line: word`, of every banned word that is not allowed."""
    return [
        f"{name}:{line}: {found[0]}"
        for line, text in texts(source, command)
        if (name, text) not in ALLOWED
        for found in BANNED.finditer(text)
    ]


def test_no_text_has_a_banned_word() -> None:
    said = [
        each
        for path in sorted(ROOT.rglob("*.py"))
        for each in banned(
            path.relative_to(ROOT).as_posix(),
            path.read_text(encoding="utf-8"),
            COMMANDS in path.parents,
        )
    ]
    assert not said, "\n".join(said)


@pytest.mark.parametrize(
    ("source", "command", "expected"),
    [
        ("x = f'the {1} effects cannot be\\ntold apart'", False, ["a.py:1: told", "a.py:1: apart"]),
        ('def f():\n    """Nobody reads this."""', False, []),
        ('def f():\n    """Nobody reads this."""', True, ["a.py:2: Nobody"]),
        ("x = 'stop at rest; the rest of it'", False, ["a.py:1: rest"]),
        ("x = 'told'", False, ["a.py:1: told"]),
    ],
)
def test_planted_words_are_found(source: str, command: bool, expected: list[str]) -> None:
    assert banned("a.py", source, command) == expected
