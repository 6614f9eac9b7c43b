"""Runs a notebook as a kernel would: its code cells in order, in this one fresh process.

    python run_notebook.py NOTEBOOK.ipynb

What ends a cell is shown as a notebook shows it: its HTML if it has any, its repr otherwise. A
kernel of Jupyter would bring some thirty packages for no more than that.
"""

import ast
import json
import sys
from pathlib import Path
from typing import Any


def run(path: Path) -> None:
    """Run and print; ends with the cell's error if one fails."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        if cell["cell_type"] != "code":
            continue
        body = ast.parse("".join(cell["source"]), f"cell {number}").body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        exec(compile(ast.Module(body, []), f"cell {number}", "exec"), names)
        if isinstance(last, ast.Expr):
            shown = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
            html = getattr(shown, "_repr_html_", lambda: None)()
            print(repr(shown) if html is None else html)


if __name__ == "__main__":
    run(Path(sys.argv[1]))
