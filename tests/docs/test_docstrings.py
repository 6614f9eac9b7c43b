"""Every public module, class, function and method says what it is."""

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "excite_cli"
Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def public(path: Path) -> Iterator[tuple[str, Documented]]:
    """Public names of a file, the module first; nothing within functions, no private parts."""
    module = ast.parse(path.read_text(encoding="utf-8"))
    name = "/".join(path.parts[-2:])
    yield name, module
    todo: list[tuple[str, Documented]] = [(name, module)]
    while todo:
        where, node = todo.pop()
        for child in node.body:
            if not isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            if child.name.startswith("_") or _overloaded(child):
                continue
            yield f"{where}: {child.name}", child
            if isinstance(child, ast.ClassDef):
                todo.append((f"{where}: {child.name}", child))


def _overloaded(node: ast.AST) -> bool:
    """Overrides take the docstring of what they override."""
    decorators = getattr(node, "decorator_list", [])
    return any("override" in ast.unparse(decorator) for decorator in decorators)


def coverage(package: Path) -> tuple[int, list[str]]:
    """How many public names there are, and which of them have no docstring."""
    names = [pair for path in sorted(package.rglob("*.py")) for pair in public(path)]
    return len(names), [name for name, node in names if not ast.get_docstring(node)]


def test_every_public_name_has_a_docstring() -> None:
    count, bare = coverage(PACKAGE)
    print(f"{count - len(bare)} of {count} public names: {100 * (1 - len(bare) / count):.1f} %")
    assert not bare, "no docstring:\n" + "\n".join(bare)
    assert count > 1000


def test_a_missing_docstring_is_noticed(tmp_path: Path) -> None:
    text = '"""Has one."""\n\n\nclass Bare:\n    def method(self): ...\n\n    def _own(self): ...\n'
    (tmp_path / "bare.py").write_text(text, encoding="utf-8")
    count, bare = coverage(tmp_path)
    assert count == 3
    assert [name.rpartition(": ")[2] for name in bare] == ["Bare", "method"]
