"""What installed packages add to a family: subclasses that they name in an entry point."""

import inspect
import warnings
from collections.abc import Iterator, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from excite_cli.errors import ExciteWarning

Member = TypeVar("Member")


def members(
    group: str, base: type[Member], needed: Sequence[str], word: str
) -> Iterator[tuple[str, type[Member]]]:
    """Subclasses of `base` that state all that is `needed`, each with whose it is, for messages.

    From entry points of a `group`, which are called a `word`. One that cannot be used is set aside,
    with an `ExciteWarning` that says why.
    """
    for point in entry_points(group=group):
        found, flaw = _loaded(point, base, needed)
        whose = f"{word} '{point.name}' ({point.value})"
        if found is None:
            set_aside(whose, f"{flaw}.")
        else:
            yield whose, found


def set_aside(which: str, why: str) -> None:
    """Warn of a member of a package that cannot be used."""
    warnings.warn(f"{which} of a package is set aside: {why}", ExciteWarning, stacklevel=2)


def _loaded(
    point: EntryPoint, base: type[Member], needed: Sequence[str]
) -> tuple[type[Member] | None, str]:
    """What an entry point leads to; or why it cannot be used."""
    try:
        found = point.load()
    except (Exception, SystemExit) as error:
        return None, f"it cannot be loaded ({type(error).__name__}: {error})"
    if not (isinstance(found, type) and issubclass(found, base)):
        return None, f"it is not a subclass of {base.__name__}"
    if inspect.isabstract(found):
        return None, f"it lacks {', '.join(sorted(getattr(found, '__abstractmethods__', ())))}"
    missing = [name for name in needed if not getattr(found, name, None)]
    if missing:
        return None, f"it does not state its {', '.join(missing)}"
    return found, ""
