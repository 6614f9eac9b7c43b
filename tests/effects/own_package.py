"""The effect that docs/how-to/effect.md writes, and what an installer leaves of its package."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from excite_cli.effects.catalogue import EFFECTS

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "effect.md"
MODULE = "my_effects"
_AS_ABOVE = "class RollerFriction(Effect):\n    ...  # as above\n"


def blocks(language: str) -> list[str]:
    """Code of the page in its order."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def code() -> str:
    """The class with its columns and all that it states of itself."""
    columns, traits = blocks("python")
    imports, body = traits.split(_AS_ABOVE)
    first, rest = columns.split("\n\n\nclass ")
    return f"{first}\n{imports.strip()}\n\n\nclass {rest.rstrip()}\n{body}"


def points() -> dict[str, str]:
    """Its entry points."""
    found: dict[str, str] = tomllib.loads(blocks("toml")[0])["project"]["entry-points"][
        EFFECTS.group
    ]
    return found


def install(
    folder: Path,
    text: str,
    names: dict[str, str],
    patch: pytest.MonkeyPatch,
    module: str = MODULE,
    group: str = EFFECTS.group,
) -> None:
    """What an installer leaves of a package with one module; it can be imported."""
    (folder / f"{module}.py").write_text(text, encoding="utf-8")
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    lines = [f"[{group}]", *(f"{name} = {value}" for name, value in names.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    patch.syspath_prepend(folder)
    patch.delitem(sys.modules, module, raising=False)
