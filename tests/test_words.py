"""Words that no message, table or help text has: an engineer reads them twice.

What is meant by each: residual, held-out, error reduction, known mass, rejected candidate,
distinguish, identify, report.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "excite_cli"
BANNED = re.compile(
    r"\b(told|tells?|sealed|takes off|taken off|at hand|nobody|whoever|suspects?|what stays|"
    r"weighed|rests on|trifle)\b",
    re.IGNORECASE,
)
# Names that programs read: options and verdicts of 0.2, messages between processes.
NAMES = {
    ("cli/app.py", "sealed"),
    ("diagnosis/verdict.py", "rests on what was weighed"),
    ("workers/context.py", "workers at hand"),
    ("workers/worker_main.py", "told"),
    ("workers/processes.py", "told"),
}


def texts(source: str, command: str) -> Iterator[tuple[int, str]]:
    """Literals of a module with their lines; of docstrings that of the `command`, its help."""
    tree = ast.parse(source)
    hidden = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body:
            first = node.body[0]
            is_help = isinstance(node, ast.FunctionDef) and node.name == command
            if isinstance(first, ast.Expr) and not is_help:
                hidden.add(id(first.value))
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in hidden
        ):
            yield node.lineno, node.value


def banned(source: str, name: str, command: str = "") -> list[str]:
    """`file:line: word in text` of every banned word."""
    return [
        f"{name}:{line}: '{found[0]}' in {text[:80]!r}"
        for line, text in texts(source, command)
        if (name, text) not in NAMES
        for found in [BANNED.search(text)]
        if found
    ]


def test_no_text_has_a_banned_word() -> None:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        command = path.stem if name.startswith("cli/") else ""
        found += banned(path.read_text(encoding="utf-8"), name, command)
    assert not found, "\n".join(found)


def test_a_planted_word_is_found() -> None:
    source = '"""Nobody reads this."""\ndef f():\n    """Told to him."""\n    return "was told"\n'
    assert banned(source, "a.py") == ["a.py:4: 'told' in 'was told'"]
    assert len(banned(source, "cli/f.py", "f")) == 2
