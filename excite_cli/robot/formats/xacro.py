"""xacro: a URDF with macros, arguments and includes, expanded by the xacro package.

Its expressions are Python, it reads any file, and any variable of the environment. A robot's file
is not a program that one means to run: here expressions are evaluated by `xacro_expression`, files
are read within the robot's folders (`allowed_files`), and variables are those of a list.
"""

import glob
import os
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from xml.dom import minidom

from excite_cli.errors import MissingExtraError, RobotError
from excite_cli.robot.allowed_files import AllowedFiles, OutsideError, allowed_files
from excite_cli.robot.formats import xacro_expression
from excite_cli.robot.formats.base import ConversionRequest, RobotFormat, Urdf
from excite_cli.robot.ros_packages import MissingPackageError, find_package, unnamed_package
from excite_cli.robot.urdf_check import xml_text

_NAMESPACE = re.compile(r"xmlns:xacro\s*=")
_VARIABLES = ("ROS_DISTRO", "ROS_VERSION")  # of the environment, that a file may ask for
_OF_ARGUMENTS = " Arguments are given under robot.xacro_args (init: --xacro-arg NAME=VALUE)."
# What is replaced in the library: where one is missing, it is a version that nobody has tried.
_REPLACED = ("safe_eval", "parse", "load_yaml", "glob", "_global_symbols", "process_file")
_REPLACED_SUBSTITUTIONS = ("_eval", "_eval_env", "_eval_optenv", "_eval_find", "convert_value")


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

    def load_library(self) -> None:
        """The xacro package."""
        library_of_xacro()

    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """The expanded text; `$(find package)` as `_Packages.find` does."""
        library = library_of_xacro()
        allowed = allowed_files(path, asked.package_dirs)
        packages = _Packages(path, allowed, asked.absent)
        _replace(library, allowed, packages.find)
        arguments = {
            name: str(value).lower() if isinstance(value, bool) else str(value)
            for name, value in asked.arguments.items()
        }
        try:
            expanded = library.process_file(str(path), mappings=arguments).toxml()
        except Exception as error:  # xacro raises whatever an expression raises
            own = _own_error(error)
            if isinstance(own, (OutsideError, MissingPackageError)):
                raise own from error
            reason = " ".join(str(own or error).split()).rstrip(".") or type(error).__name__
            advice = _OF_ARGUMENTS if "rgument" in reason else ""
            raise RobotError(
                f"{path.name}: xacro cannot expand it: {reason[:600]}.{advice}"
            ) from error
        return packages.named_in(expanded)


class _Packages:
    """The packages that one file asks for.

    For one that is nowhere (`absent`) stands the one that the file lies in: its folder was renamed
    and lost its package.xml.
    """

    def __init__(self, path: Path, allowed: AllowedFiles, absent: Collection[str]) -> None:
        self._path, self._allowed, self._absent = path, allowed, absent
        self._found: dict[str, Path] = {}
        self._stand_ins: dict[str, Path] = {}

    def find(self, name: str) -> str:
        """The folder of a package."""
        try:
            self._found[name] = find_package(name, self._allowed)
        except MissingPackageError:
            own = unnamed_package(self._path)
            if own is None or name not in self._absent:
                raise
            self._found[name] = self._stand_ins[name] = own
        return str(self._found[name])

    def named_in(self, text: str) -> Urdf:
        """The URDF, with the packages that stand in, and where the others were found."""
        for name, folder in self._stand_ins.items():
            text = text.replace(f"package://{name}/", f"file://{folder}/")
        notes = [
            f"the package '{name}' was not found: {folder}, which the file lies in, is taken for it"
            for name, folder in self._stand_ins.items()
        ]
        notes += [
            f"the package '{name}' is {folder}"
            for name, folder in self._found.items()
            if name not in self._stand_ins and folder.resolve() != self._allowed.own
        ]
        folders = tuple(sorted({str(folder) for folder in self._stand_ins.values()}))
        return Urdf(text, folders, tuple(notes))


def _replace(library: Any, allowed: AllowedFiles, find: Callable[[str], str]) -> None:
    """Put what is safe in place of what the library does with expressions, files, variables."""
    substitution = library.substitution_args
    for owner, names in ((library, _REPLACED), (substitution, _REPLACED_SUBSTITUTIONS)):
        for name in names:
            if not hasattr(owner, name):
                raise MissingExtraError(
                    f"the installed version of the package xacro has no {name}, and is not one "
                    "that excite knows. Run: pip install --force-reinstall 'excite-cli[formats]'."
                )
    symbols = xacro_expression.symbols(_functions_of_xacro(library, allowed))
    library._global_symbols = symbols
    library.load_yaml = symbols["load_yaml"]
    library.safe_eval = lambda text, names, local=None: xacro_expression.evaluate(
        text, names, symbols
    )
    library.parse = partial(_parsed, library, allowed)
    library.glob = _Patterns(allowed)
    substitution._eval = partial(_substituted, library, symbols, find)
    substitution._eval_find = find
    substitution._eval_env = _variable
    substitution._eval_optenv = lambda name, default="": _optional_variable(name, default)


def _functions_of_xacro(library: Any, allowed: AllowedFiles) -> dict[str, Any]:
    """The namespace `xacro` of expressions: `arg`, `load_yaml` and others that do no harm."""
    read_table = _table_reader()

    def load_yaml(name: str) -> Any:
        path = allowed.require(Path(library.abs_filename_spec(name)))
        if not path.is_file():
            raise RobotError(f"there is no file {path}")
        xml_text(path, "a table of a xacro")  # of a size that may be read
        return read_table(str(path))

    def argument(name: str) -> Any:
        return library.substitution_args_context["arg"][name]

    def fatal(*words: object) -> None:
        raise ValueError(" ".join(map(str, words)))

    silent = dict.fromkeys(
        ("message", "warning", "error", "print_location"), lambda *words, **how: ""
    )
    return {
        "arg": argument,
        "load_yaml": load_yaml,
        "abs_filename": library.abs_filename_spec,
        "dotify": lambda *table, **more: dict(*table, **more),
        "tokenize": library.tokenize,
        "fatal": fatal,
        **silent,
    }


def _parsed(library: Any, allowed: AllowedFiles, given: None, name: str) -> Any:
    """The document of a file, with what xacro took without its prefix until 2020."""
    path = allowed.require(Path(name))
    if not path.is_file():  # the library passes over an include that is optional
        library.filestack.pop()
        raise library.XacroException(f"there is no file {path}", exc=FileNotFoundError())
    document: Any = minidom.parseString(xml_text(path, "a xacro"))
    for element in document.documentElement.childNodes:
        old = element.nodeName in ("property", "include") and element.hasAttribute(
            "value" if element.nodeName == "property" else "filename"
        )
        if old:
            element.tagName = element.nodeName = f"xacro:{element.nodeName}"
    return document


@dataclass(frozen=True)
class _Patterns:
    """Python's module glob, for patterns that begin in a folder that may be read."""

    allowed: AllowedFiles

    def glob(self, pattern: str) -> list[str]:
        """The files that a pattern means."""
        self.allowed.require(Path(re.split(r"[*?\[]", pattern)[0] + "_").parent)
        return glob.glob(pattern)


def _own_error(error: BaseException) -> RobotError | None:
    """An error of ours that xacro wrapped."""
    found: BaseException | None = error
    while found is not None and not isinstance(found, RobotError):
        found = found.__cause__ or getattr(found, "exc", None) or found.__context__
    return found


def _variable(name: str) -> str:
    """The value of `$(env NAME)`."""
    if name not in _VARIABLES:
        raise RobotError(
            f"the variable {name} of the environment is not read (only {', '.join(_VARIABLES)} "
            "are): write its value into the file"
        )
    if name not in os.environ:
        raise RobotError(f"the variable {name} of the environment is not set")
    return os.environ[name]


def _optional_variable(name: str, default: str) -> str:
    """The value of `$(optenv NAME default)`; of a variable that is not read, the default."""
    return os.environ.get(name, default) if name in _VARIABLES else default


def _substituted(
    library: Any,
    symbols: Mapping[str, Any],
    find: Callable[[str], str],
    text: str,
    context: Mapping[str, Any],
) -> str:
    """The value of `$(eval …)`, in which arguments are names as well."""
    convert = library.substitution_args.convert_value
    given = context.get("arg", {})
    functions = {
        **{name: symbols[name] for name in xacro_expression.OF_EVAL},
        "arg": lambda name: convert(given[name], "auto"),
        "find": find,
        "env": _variable,
        "optenv": _optional_variable,
    }
    names = {name: symbols[name] for name in xacro_expression.BELOW_ARGUMENTS}
    names |= {name: convert(value, "auto") for name, value in given.items()}
    names |= {**functions, "true": True, "false": False}
    functions |= {name: symbols[name] for name in xacro_expression.BELOW_ARGUMENTS}
    return str(xacro_expression.evaluate(text, names, functions))


@cache
def _table_reader() -> Callable[[str], Any]:
    """The library's own reader of YAML (a safe one, with units), before it was replaced."""
    reader: Callable[[str], Any] = library_of_xacro().load_yaml
    return reader


def library_of_xacro() -> Any:
    """The package, imported.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    try:
        import xacro
        import xacro.substitution_args
    except ImportError as error:
        raise MissingExtraError(
            "Files of xacro need the package xacro, which is not installed. Run: pip install "
            "'excite-cli[formats]', or expand the file with `xacro FILE > robot.urdf`."
        ) from error
    return xacro
