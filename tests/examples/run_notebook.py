"""Runs a notebook as a kernel would: its code cells in order, in this one fresh process.

    python -m tests.examples.run_notebook NOTEBOOK.ipynb EXECUTED.ipynb
    python -m tests.examples.run_notebook NOTEBOOK.ipynb            (stores its outputs in it)

What ends a cell is shown as a notebook shows it, and so are figures of pyplot. A kernel of Jupyter
would bring some thirty packages for no more than that. Outputs are stored from a folder in which
`data` is that of the repository, so that no path of a machine is in them.
"""

import ast
import io
import json
import os
import sys
import tempfile
from base64 import b64encode
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

DOTS_PER_INCH = 80


def executed(path: Path) -> dict[str, Any]:
    """The notebook with its outputs; ends with the cell's error if one fails."""
    names: dict[str, Any] = {"__name__": "__main__"}
    book = json.loads(path.read_text(encoding="utf-8"))
    code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(code, 1):
        body = ast.parse("".join(cell["source"]), f"cell {number}").body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        told, noted, shown = io.StringIO(), io.StringIO(), None
        with redirect_stdout(told), redirect_stderr(noted):
            exec(compile(ast.Module(body, []), f"cell {number}", "exec"), names)
            if last is not None:
                shown = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
        outputs: list[dict[str, Any]] = [
            {"output_type": "stream", "name": name, "text": lines(text.getvalue())}
            for name, text in (("stderr", noted), ("stdout", told))
            if text.getvalue()
        ]
        if shown is not None and not "".join(cell["source"]).rstrip().endswith(";"):
            data = {"text/plain": lines(repr(shown))}
            html = getattr(shown, "_repr_html_", lambda: None)()
            data |= {} if html is None else {"text/html": lines(html)}
            kind = {"output_type": "execute_result", "execution_count": number}
            outputs.append({**kind, "data": data, "metadata": {}})
        outputs += [
            {"output_type": "display_data", "data": {"image/png": each}, "metadata": {}}
            for each in figures()
        ]
        cell |= {"outputs": outputs, "execution_count": number}
    return book


def figures() -> list[str]:
    """Open figures of pyplot as PNG, base64; they are closed."""
    pyplot = sys.modules.get("matplotlib.pyplot")
    found = []
    for number in pyplot.get_fignums() if pyplot else ():
        file = io.BytesIO()
        pyplot.figure(number).savefig(file, dpi=DOTS_PER_INCH)
        found.append(b64encode(file.getvalue()).decode("ascii"))
    if pyplot:
        pyplot.close("all")
    return found


def lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


if __name__ == "__main__":
    os.environ |= {"MPLBACKEND": "agg", "COLUMNS": "100"}
    given, *to = (Path(each).resolve() for each in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        if not to:
            os.chdir(folder)
            Path("data").symlink_to(Path(__file__).parents[2] / "data")
        text = json.dumps(executed(given), indent=1, ensure_ascii=False) + "\n"
    (to or [given])[0].write_text(text, encoding="utf-8")
