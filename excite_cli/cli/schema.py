"""`excite schema`: the JSON Schema of the YAML problem, for editors."""

from pathlib import Path

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


@options.with_messages
def schema(
    terminal: Terminal,
    output: Path | None = options.written("--output", "-o", help="Write it to this file."),
    overwrite: options.Overwrite = False,
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
        terminal.show(save_schema(output, overwrite))
