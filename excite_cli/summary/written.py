"""The files that a command has written, told at the end of its answer."""

from collections.abc import Mapping


def files_in_words(files: Mapping[str, str]) -> list[str]:
    """One line for all `files`, by what they hold; none if nothing was written."""
    listed = ", ".join(f"{path} ({kind})" for kind, path in files.items())
    return [f"Written: {listed}."] if files else []
