"""What the linter of layers does not see: cycles, also through imports inside functions."""

import ast
import re
import tomllib
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LONGEST_COMMAND = 60  # lines of a body, without what says its options


def modules() -> dict[str, Path]:
    """Every module of the package by its name."""
    found = {}
    for path in (ROOT / "excite_cli").rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those that only type checkers see."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        yield node
        yield from statements(node)


def imported(path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of the package that `path` imports, at its top or inside a function."""
    found = set()
    for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in known else node.module)
    return {name for name in found if name in known}


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """A cycle of imports; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    known = modules()
    graph = {name: imported(path, known) for name, path in known.items()}
    assert len(graph) > 400
    assert sum(map(len, graph.values())) > 1000
    assert cycle(graph) == []


def test_a_cycle_inside_functions_would_be_found(tmp_path: Path) -> None:
    first, second = tmp_path / "first.py", tmp_path / "second.py"
    first.write_text("from p.second import x\n")
    second.write_text("def f():\n    if True:\n        import p.first\n")
    known = {"p.first": first, "p.second": second}
    assert cycle({name: imported(path, known) for name, path in known.items()})
    second.write_text("if TYPE_CHECKING:\n    import p.first\n")
    assert not cycle({name: imported(path, known) for name, path in known.items()})


def test_commands_know_no_room_but_the_front_door() -> None:
    """A new room is forbidden to them by the linter's contract, too."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (contract,) = [each for each in contracts if each.get("source_modules") == ["excite_cli.cli"]]
    rooms = {f"excite_cli.{name.split('.')[1]}" for name in modules() if "." in name}
    known = {f"excite_cli.{name}" for name in ("__main__", "api", "cli", "config", "errors")}
    assert set(contract["forbidden_modules"]) == rooms - known


# The linter does not see what is imported by its name.
OPTIONAL = {
    "PIL": {"view"},
    "distributed": {"workers"},
    "embreex": {"view"},
    "jinja2": {"report"},
    "matplotlib": {"report"},
    "mujoco": {"robot", "simulation"},
    "pandas": {"shown"},
    "rosbags": {"measurement", "motion_formats"},
    "viser": {"view"},
}


def test_optional_libraries_are_known_to_their_rooms_alone() -> None:
    rooms: dict[str, set[str]] = {}
    for path in sorted((ROOT / "excite_cli").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"optional_module\(\s*f?\"(\w+)", text):
            rooms.setdefault(name, set()).add(path.relative_to(ROOT / "excite_cli").parts[0])
    assert rooms == OPTIONAL


def test_commands_parse_call_and_show() -> None:
    for path in sorted((ROOT / "excite_cli" / "cli").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                assert lines < LONGEST_COMMAND, f"{path.name}: {node.name} has {lines} lines"


def test_the_map_has_every_package_and_no_other() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    drawn = text.partition("excite_cli/\n")[2].partition("```")[0]
    named = set(re.findall(r"(?:^  |\s{2}|, )([a-z_]+(?:/|\.py))(?=\s)", drawn, re.MULTILINE))
    package = ROOT / "excite_cli"
    folders = {f"{path.parent.name}/" for path in package.glob("*/__init__.py")}
    files = {path.name for path in package.glob("*.py") if not path.name.startswith("__")}
    assert named == folders | files
