"""`excite schema`: the JSON Schema of the YAML problem, for editors."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT


def schema(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Write it to this file.", rich_help_panel=OUTPUT),
    ] = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Print the JSON Schema of the config; editors complete and check from it.

    An editor with the YAML language server (VS Code, Neovim, Emacs …) uses it if the first line of
    the config is `# yaml-language-server: $schema=excite.schema.json`, a path that starts from the
    config. With -o the file is named, without it the schema is printed.

    Examples:
      excite schema -o excite.schema.json
      excite schema
    """
    import json

    from excite_cli.api.outputs import check_outputs
    from excite_cli.atomic import write_atomically
    from excite_cli.config.spec import Spec

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    text = json.dumps(Spec.model_json_schema(), indent=2, ensure_ascii=False)
    if output is None:
        print(text)
        return
    check_outputs({"output": output}, overwrite)

    def write(path: Path) -> None:
        path.write_text(text + "\n", encoding="utf-8")

    write_atomically(output, write)
    terminal.answer(
        [str(output), f"First line of a config: # yaml-language-server: $schema={output}"],
        {"output": str(output)},
    )
