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
    """Print the JSON Schema of the config, for completion and checks in editors.

    An editor with the YAML language server (VS Code, Neovim, Emacs …) uses it if the first line of
    the config is `# yaml-language-server: $schema=excite.schema.json`, a path that starts from the
    config. With -o the file is named, without it the schema is printed.

    Examples:
      excite schema -o excite.schema.json
      excite schema
    """
    from excite_cli.api.schema import config_schema, save_schema

    if output is None:
        print(config_schema())
    else:
        terminal = Terminal(as_json, quiet, verbose, not no_progress)
        terminal.show(save_schema(output, overwrite))
