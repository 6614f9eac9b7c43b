"""The members of a family by name: the program's own, and those that installed packages add.

A package adds one by an entry point of the family's group, which leads to a subclass of its base.
"""

import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar, cast

from excite_cli.errors import ConfigError, ExciteWarning, nearest

Member = TypeVar("Member")


@dataclass(frozen=True)
class Registry(Generic[Member]):
    """A family, whose entry points have the `group` excite.<family> and whose members are a `word`.

    `own`: the program's members, in order, subclasses of `base`. Each states all that is `needed`,
    its name first, unless `name_of` says what it is called. `flaw_in`: what else is wrong with a
    member beside the others, as a sentence.
    """

    word: str
    group: str
    base: type
    own: Sequence[type[Member]]
    needed: tuple[str, ...] = ("name",)
    flaw_in: Callable[[type[Member], Mapping[str, type[Member]]], str] | None = None
    name_of: Callable[[type[Member]], str] | None = None

    @cached_property
    def members(self) -> Mapping[str, type[Member]]:
        """All by name, the program's own first.

        One of a package that cannot be used is set aside, with an `ExciteWarning` that says why.
        """
        found = {self._name(member): member for member in self.own}
        for whose, member in self._of_packages():
            if (name := self._name(member)) in found:
                self.set_aside(whose, f"there is another {self.word} '{name}'.")
            else:
                found[name] = member
        for name in [name for name, member in found.items() if self.is_foreign(member)]:
            if self.flaw_in and (flaw := self.flaw_in(found[name], found)):
                self.set_aside(f"{self.word} '{name}'", flaw)
                del found[name]
        return found

    @property
    def foreign(self) -> Mapping[str, type[Member]]:
        """Those of packages."""
        return {name: each for name, each in self.members.items() if self.is_foreign(each)}

    @property
    def foreign_first(self) -> list[type[Member]]:
        """Those of packages, then the program's own: who knows a special case is asked first."""
        return [*self.foreign.values(), *self.own]

    def is_foreign(self, member: type[Member]) -> bool:
        """Whether it came through an entry point: it may do what own ones never do."""
        return member not in self.own

    def named(self, name: str, where: str, among: Sequence[str] = ()) -> type[Member]:
        """The member of that name, of those `among` which one may be; all without any.

        Raises
        ------
        ConfigError
            There is none; the message begins with `where` it was named.
        """
        allowed = among or tuple(self.members)
        if name not in allowed:
            aside = name not in self.members and name in self._declared
            advice = " A package has one, which cannot be used: see the warning."
            raise ConfigError(
                f"{where}: there is no {self.word} '{name}'."
                f"{advice if aside else nearest(name, allowed)} "
                f"Known: {', '.join(allowed) or 'none'}."
            )
        return self.members[name]

    def set_aside(self, which: str, why: str) -> None:
        """Warn of a member of a package that cannot be used."""
        warnings.warn(f"{which} of a package is set aside: {why}", ExciteWarning, stacklevel=2)

    def forget(self) -> None:
        """Look for the members of packages anew when they are next asked for."""
        self.__dict__.pop("members", None)

    @property
    def _declared(self) -> set[str]:
        return {point.name for point in entry_points(group=self.group)}

    def _name(self, member: type[Member]) -> str:
        return self.name_of(member) if self.name_of else str(getattr(member, self.needed[0]))

    def _of_packages(self) -> Iterator[tuple[str, type[Member]]]:
        """Usable members, each with whose it is, for messages."""
        for point in entry_points(group=self.group):
            found, flaw = self._loaded(point)
            whose = f"{self.word} '{point.name}' ({point.value})"
            if found is None:
                self.set_aside(whose, f"{flaw}.")
            else:
                yield whose, found

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
        missing = [name for name in self.needed if not getattr(found, name, None)]
        if missing:
            return None, f"it does not state its {', '.join(missing)}"
        return cast(type[Member], found), ""
