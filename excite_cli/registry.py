"""The members of a family by name: the program's own, and those that installed packages add.

A package adds one by an entry point of the family's group, which leads to a subclass of its base.
"""

import inspect
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from pkgutil import resolve_name
from typing import Generic, TypeVar, cast

from excite_cli.errors import ConfigError, ExciteWarning, nearest

Member = TypeVar("Member")


@dataclass(frozen=True)
class Registry(Generic[Member]):
    """A family, whose entry points have the `group` excite.<family> and whose members are a `word`.

    `own`: the program's members by name, in order, as `module:Class` in the package of their
    `base`; they are imported when they are asked for. What packages add states all that is
    `needed`, its name first. `flaw_in`: what else is wrong with it beside these names, a sentence.
    """

    word: str
    group: str
    base: type
    own: Mapping[str, str]
    needed: tuple[str, ...] = ("name",)
    flaw_in: Callable[[type[Member], Collection[str]], str] | None = None

    @cached_property
    def members(self) -> dict[str, type[Member]]:
        """All by name, the program's own first."""
        package = self.base.__module__.rpartition(".")[0]
        own = {name: resolve_name(f"{package}.{place}") for name, place in self.own.items()}
        return {**own, **self.foreign}

    @cached_property
    def foreign(self) -> Mapping[str, type[Member]]:
        """Those of packages.

        One that cannot be used is set aside, with an `ExciteWarning` that says why.
        """
        found: dict[str, type[Member]] = {}
        for point in entry_points(group=self.group):
            member, flaw = self._loaded(point)
            name = "" if member is None else str(getattr(member, self.needed[0]))
            if name in self.own or name in found:
                member, flaw = None, f"there is another {self.word} '{name}'"
            if member is None:
                self.set_aside(f"{self.word} '{point.name}' ({point.value})", f"{flaw}.")
            else:
                found[name] = member
        for name, member in list(found.items()):
            if self.flaw_in and (flaw := self.flaw_in(member, [*self.own, *found])):
                self.set_aside(f"{self.word} '{name}'", flaw)
                del found[name]
        return found

    @property
    def names(self) -> list[str]:
        """Of all members, without an import of the program's own."""
        return [*self.own, *self.foreign]

    @property
    def foreign_first(self) -> list[type[Member]]:
        """All members; who knows a special case is asked first."""
        return [*self.foreign.values(), *(self.members[name] for name in self.own)]

    def named(self, name: str, where: str, among: Sequence[str] | None = None) -> type[Member]:
        """The member of that name, `among` all or these; ConfigError if there is none `where`."""
        allowed = list(self.members) if among is None else among
        if name in allowed:
            return self.members[name]
        advice = nearest(name, allowed)
        if name not in self.members and name in entry_points(group=self.group).names:
            advice = " A package has one, which cannot be used: see the warning."
        known = ", ".join(allowed) or "none"
        raise ConfigError(f"{where}: there is no {self.word} '{name}'.{advice} Known: {known}.")

    def set_aside(self, which: str, why: str) -> None:
        """Warn of a member of a package that cannot be used."""
        warnings.warn(f"{which} of a package is set aside: {why}", ExciteWarning, stacklevel=2)

    def _loaded(self, point: EntryPoint) -> tuple[type[Member] | None, str]:
        """What an entry point leads to; or why it cannot be used."""
        try:
            found = point.load()
        except (Exception, SystemExit) as error:
            return None, f"it cannot be loaded ({type(error).__name__}: {error})"
        if not (isinstance(found, type) and issubclass(found, self.base)):
            return None, f"it is not a subclass of {self.base.__name__}"
        if inspect.isabstract(found):
            return None, f"it lacks {', '.join(sorted(getattr(found, '__abstractmethods__', ())))}"
        if missing := [name for name in self.needed if not getattr(found, name, None)]:
            return None, f"it does not state its {', '.join(missing)}"
        return cast(type[Member], found), ""
