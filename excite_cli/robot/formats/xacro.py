"""xacro: a URDF with macros, arguments and includes, expanded by the xacro package.

Its expressions are Python. The package keeps builtins from most of them, not from `$(eval …)`, and
lets some ways round; a robot's file is not a program that one means to run, so expressions are
evaluated here, without builtins and without what leads to them.
"""

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

from excite_cli.errors import MissingExtraError, RobotError
from excite_cli.robot.formats.base import Asked, RobotFormat, Urdf
from excite_cli.robot.packages import find_package, unnamed_package

_NAMESPACE = re.compile(r"xmlns:xacro\s*=")
# Names that lead from a value to the interpreter's own objects.
_HIDDEN = re.compile(r"__|^(gi|cr|ag|f|tb|co|func)_|^mro$")


class Xacro(RobotFormat):
    """Recognised by its suffix or its namespace."""

    name = "xacro"

    def recognises(self, path: Path, text: str) -> bool:
        """`.xacro`, or elements of `xmlns:xacro`.

        In a `.urdf` such are left over, unless all of the robot is in what it includes.
        """
        if path.suffix == ".xacro":
            return True
        if path.suffix == ".urdf" and ("<xacro:include" not in text or "<joint" in text):
            return False
        return bool(_NAMESPACE.search(text) and "<xacro:" in text)

    def urdf(self, path: Path, text: str, asked: Asked) -> Urdf:
        """The expanded text; `$(find package)` as `find_package` does.

        A package that is nowhere may be the one that the file lies in, whose folder was renamed
        and lost its package.xml: it is tried, and told.
        """
        library = _library()
        arguments = {name: _written(value) for name, value in asked.arguments.items()}

        stand_ins: dict[str, Path] = {}

        def find(name: str) -> str:
            try:
                return str(find_package(name, path, asked.package_dirs))
            except RobotError:
                own = unnamed_package(path)
                if own is None:
                    raise
                stand_ins[name] = own
                return str(own)

        substitution = library.substitution_args
        substitution._eval_find = substitution._eval_dict["find"] = find
        substitution._eval = _substituted
        library.safe_eval = _evaluated
        library.parse = partial(_parsed, library.parse)
        try:
            text = library.process_file(str(path), mappings=arguments).toxml()
        except Exception as error:  # xacro raises whatever an expression raises
            reason = _reason(error)
            raise RobotError(
                f"{path.name}: xacro cannot expand it: {reason[:400]}. Arguments are given under "
                "robot.xacro_args (init: --xacro-arg NAME=VALUE), folders of packages under "
                "robot.package_dirs (init: --package-dirs)."
            ) from error
        for name, folder in stand_ins.items():
            text = text.replace(f"package://{name}/", f"file://{folder}/")
        folders = tuple(sorted({str(folder) for folder in stand_ins.values()}))
        notes = tuple(
            f"the package '{name}' was not found: {folder}, which the file lies in, is taken for it"
            for name, folder in stand_ins.items()
        )
        return Urdf(text, folders, notes)


def _parsed(parse: Callable[..., Any], given: Any, name: str | None = None) -> Any:
    """The document, with what xacro took without its prefix until 2020: properties and includes."""
    document = parse(given, name)
    for element in document.documentElement.childNodes:
        old = element.nodeName in ("property", "include") and element.hasAttribute(
            "value" if element.nodeName == "property" else "filename"
        )
        if old:
            element.tagName = element.nodeName = f"xacro:{element.nodeName}"
    return document


def _reason(error: BaseException) -> str:
    """In words; of an error of ours that xacro wrapped, its own."""
    ours: BaseException | None = error
    while ours is not None and not isinstance(ours, RobotError):
        ours = ours.__cause__ or ours.__context__
    return " ".join(str(ours or error).split()) or type(error).__name__


def _written(value: object) -> str:
    """An argument as xacro takes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _evaluated(text: str, symbols: dict[str, Any], local: Any = None) -> Any:
    """The value of an expression `${…}`.

    Raises
    ------
    ValueError
        It names what only programs need.
    """
    code = compile(text.strip(), "<expression>", "eval")
    hidden = sorted({name for name in _names(code) if _HIDDEN.search(name)})
    if hidden or "__" in text:
        raise ValueError(f"the expression {text.strip()[:60]!r} is refused: it names {hidden}")
    symbols.update(__builtins__={})
    return eval(code, symbols, local)


def _substituted(text: str, context: dict[str, Any]) -> str:
    """The value of `$(eval …)`."""
    substitution = _library().substitution_args
    given = context.get("arg", {})
    symbols = {name: substitution.convert_value(value, "auto") for name, value in given.items()}
    symbols |= {k: v for k, v in substitution._eval_dict.items() if not k.startswith("_")}
    symbols |= dict(substitution._eval_dict["__builtins__"])
    symbols["arg"] = lambda name: substitution.convert_value(given[name], "auto")
    return str(_evaluated(text, symbols))


def _names(code: CodeType) -> Iterator[str]:
    """All names in an expression and in the functions within it."""
    yield from (*code.co_names, *code.co_varnames)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _library() -> Any:
    try:
        import xacro
        import xacro.substitution_args
    except ImportError as error:
        raise MissingExtraError(
            "Files of xacro need the package xacro, which is not installed. Run: pip install "
            "'excite-cli[formats]', or expand the file with `xacro FILE > robot.urdf`."
        ) from error
    return xacro
