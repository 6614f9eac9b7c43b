"""The values of xacro's expressions, found by a walk over their syntax tree.

An expression of xacro is Python, and whatever is handed to Python's `eval` can be led from a value
to the interpreter: no list of forbidden names is complete. Here nothing is evaluated but what this
file names: numbers and texts, arithmetic, comparisons, conditions, subscripts, list
comprehensions, names, and calls of listed functions and methods. Values are plain data, or one of
the listed functions, which have no attributes here. Sizes of numbers and texts are bounded.
"""

import ast
import builtins
import datetime
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

_MAX_LENGTH = 10_000  # characters of an expression; the longest of 129 public files has 140
_MAX_ITEMS = 1_000_000  # characters or items of a value: more is no robot's
_MAX_BITS = 4096  # of an integer
_MAX_STEPS = 100_000  # nodes visited for one expression
_SHOWN = 60  # characters of an expression that messages repeat

ALLOWED = (
    "numbers, texts, lists, arithmetic, comparisons, `a if b else c`, subscripts, list "
    "comprehensions, properties, `xacro.arg` and the functions that docs/files.md lists"
)


class NameSpace(dict[str, Any]):
    """Symbols that are reached by a dot: `math.pi`."""


_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_SIGNS: dict[type, Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_METHODS: dict[type, tuple[str, ...]] = {
    str: (
        *("capitalize", "count", "endswith", "find", "isdigit", "join", "lower", "lstrip"),
        *("isnumeric", "partition", "replace", "rsplit", "rstrip", "split", "splitlines"),
        *("startswith", "strip", "title", "upper", "zfill"),
    ),
    list: ("count", "index"),
    tuple: ("count", "index"),
    dict: ("get", "items", "keys", "values"),
}
_PLAIN = (str, int, float, bool, list, tuple, dict, set, type(None), datetime.date)
# A width of several digits in `'%5d' % x` could ask for any amount of memory.
_WIDE = re.compile(r"%[^a-zA-Z%]*(\d{3}|\*)")


def _range(*numbers: int) -> list[int]:
    if len(range(*numbers)) > _MAX_ITEMS:
        raise ValueError("a range of more than a million numbers")
    return list(range(*numbers))


def _listed(function: Callable[..., Any]) -> Callable[..., list[Any]]:
    """The function with a list in place of its iterator."""
    return lambda *values, **options: list(function(*values, **options))


_BASIC: dict[str, Any] = {
    each.__name__: each
    for each in (list, dict, len, str, float, int, bool, min, max, round, sorted)
}
_BASIC |= {"map": _listed(map), "range": _range, "True": True, "False": False}
_MORE: dict[str, Any] = {
    each.__name__: each for each in (abs, all, any, divmod, isinstance, ord, set, sum, tuple)
}
_MORE |= {each.__name__: _listed(each) for each in (enumerate, filter, reversed, zip)}
# Without those of integers, whose results may have any number of digits.
_MATH: dict[str, Any] = {
    name: getattr(math, name)
    for name in (
        *("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos"),
        *("cosh", "degrees", "dist", "e", "exp", "fabs", "floor", "fmod", "fsum", "gcd"),
        *("hypot", "inf"),
        *("isclose", "isfinite", "isinf", "isnan", "log", "log10", "log2", "modf", "nan", "pi"),
        *("pow", "radians", "remainder", "sin", "sinh", "sqrt", "tan", "tanh", "tau", "trunc"),
    )
}


# Of `$(eval …)`: names that arguments cannot have, and those that they can.
OF_EVAL = tuple(_MATH)
BELOW_ARGUMENTS = ("list", "dict", "map", "str", "float", "int")


def symbols(of_xacro: Mapping[str, Any]) -> dict[str, Any]:
    """All names that an expression has beside properties, by itself and by their namespaces.

    of_xacro: the functions of the namespace `xacro`.
    """
    spaces = {
        "math": NameSpace(_MATH),
        "python": NameSpace(_BASIC | _MORE),
        "xacro": NameSpace(of_xacro),
    }
    direct = ("load_yaml", "abs_filename", "dotify")
    return {**_MATH, **_BASIC, **spaces, **{name: of_xacro[name] for name in direct}}


def evaluate(text: str, names: Mapping[str, Any], functions: Mapping[str, Any]) -> Any:
    """The value of an expression.

    names: properties and symbols by name; functions: the symbols (`symbols`), the only values that
    may be called.

    Raises
    ------
    ValueError
        It has what only programs need, or a value is too large.
    NameError, TypeError, ArithmeticError, LookupError, SyntaxError
        As Python does.
    """
    text = text.strip()
    if len(text) > _MAX_LENGTH:
        raise ValueError(f"an expression of {len(text)} characters; {_MAX_LENGTH} are read")
    return _Walk(text, names, functions).value(ast.parse(text, mode="eval").body)


class _Walk:
    """One expression: a method for each kind of node that is allowed."""

    def __init__(self, text: str, names: Mapping[str, Any], functions: Mapping[str, Any]) -> None:
        self._text, self._names = text, names
        self._callable = {id(each) for each in _functions(functions)}
        self._bound: dict[str, Any] = {}
        self._steps = 0

    def value(self, node: ast.expr) -> Any:
        """The value of a node, which is plain data, a namespace or a listed function."""
        self._steps += 1
        if self._steps > _MAX_STEPS:
            raise self._refused("too many steps")
        method = _KINDS.get(type(node))
        if method is None:
            raise self._refused(type(node).__name__)
        return self._bounded(method(self, node))

    def _refused(self, what: str) -> ValueError:
        return ValueError(
            f"the expression {self._text[:_SHOWN]!r} is refused ({what}): nothing in a robot's "
            f"file is run. Allowed are {ALLOWED}"
        )

    def _bounded(self, value: Any) -> Any:
        if isinstance(value, (NameSpace, *_PLAIN)) or _is_scope(value):
            if isinstance(value, int) and value.bit_length() > _MAX_BITS:
                raise self._refused("a number too large")
            if hasattr(value, "__len__") and len(value) > _MAX_ITEMS:
                raise self._refused("a value too large")
            return value
        if id(value) in self._callable:
            return value
        raise self._refused(f"a value of type {type(value).__name__}")

    def _constant(self, node: ast.Constant) -> Any:
        return node.value

    def _name(self, node: ast.Name) -> Any:
        if node.id in self._bound:
            return self._bound[node.id]
        try:
            return self._names[node.id]
        except KeyError:
            if node.id in vars(builtins):
                raise self._refused(f"'{node.id}'") from None
            raise NameError(f"name '{node.id}' is not defined") from None

    def _list(self, node: ast.List) -> list[Any]:
        return [self.value(each) for each in node.elts]

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.value(each) for each in node.elts)

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _boolop(self, node: ast.BoolOp) -> Any:
        ends_at = isinstance(node.op, ast.Or)
        found = None
        for each in node.values:
            found = self.value(each)
            if bool(found) is ends_at:
                break
        return found

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        if type(node.op) not in _SIGNS:
            raise self._refused(type(node.op).__name__)
        return _SIGNS[type(node.op)](self.value(node.operand))

    def _binop(self, node: ast.BinOp) -> Any:
        return self._combined(node.op, self.value(node.left), self.value(node.right))

    def _combined(self, operation: ast.operator, left: Any, right: Any) -> Any:
        if type(operation) not in _OPERATORS:
            raise self._refused(type(operation).__name__)
        whole = isinstance(left, int) and isinstance(right, int)
        if isinstance(operation, ast.Pow) and whole:
            if left.bit_length() * max(right, 0) > _MAX_BITS:
                raise self._refused("a number too large")
        elif isinstance(operation, ast.Mult) and not whole:
            some, count = (left, right) if hasattr(left, "__len__") else (right, left)
            many = hasattr(some, "__len__") and isinstance(count, int)
            if many and len(some) * max(count, 0) > _MAX_ITEMS:
                raise self._refused("a value too large")
        elif isinstance(operation, ast.Mod) and isinstance(left, str) and _WIDE.search(left):
            raise self._refused("a field too wide")
        return _OPERATORS[type(operation)](left, right)

    def _compare(self, node: ast.Compare) -> Any:
        left, found = self.value(node.left), True
        for operation, each in zip(node.ops, node.comparators, strict=True):
            right = self.value(each)
            found = _OPERATORS[type(operation)](left, right)
            if not found:
                break
            left = right
        return found

    def _subscript(self, node: ast.Subscript) -> Any:
        owner = self.value(node.value)
        if not isinstance(owner, (str, list, tuple, dict)) or _is_scope(owner):
            raise self._refused(f"a subscript of {type(owner).__name__}")
        if isinstance(node.slice, ast.Slice):
            ends = (node.slice.lower, node.slice.upper, node.slice.step)
            return owner[slice(*(None if end is None else self.value(end) for end in ends))]
        return owner[self.value(node.slice)]

    def _attribute(self, node: ast.Attribute) -> Any:
        """A symbol of a namespace, or a key of a dictionary."""
        owner = self.value(node.value)
        if not isinstance(owner, dict):
            raise self._refused(f"the attribute '{node.attr}'")
        try:
            return owner[node.attr]
        except (KeyError, AttributeError):
            if isinstance(owner, NameSpace):
                raise self._refused(f"'{ast.unparse(node)}'") from None
            raise NameError(f"name '{node.attr}' is not defined") from None

    def _call(self, node: ast.Call) -> Any:
        function = self._method(node.func) or self.value(node.func)
        values = [each for argument in node.args for each in self._argument(argument)]
        options = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                raise self._refused("**")
            options[keyword.arg] = self.value(keyword.value)
        if not callable(function):
            raise self._refused(f"a call of {type(function).__name__}")
        return function(*values, **options)

    def _argument(self, node: ast.expr) -> list[Any]:
        if isinstance(node, ast.Starred):
            return list(self.value(node.value))
        return [self.value(node)]

    def _method(self, node: ast.expr) -> Callable[..., Any] | None:
        """What is called as `value.method(…)`, if it is a listed one of plain data."""
        if not isinstance(node, ast.Attribute):
            return None
        owner = self.value(node.value)
        if isinstance(owner, NameSpace) or _is_scope(owner):
            return None
        for kind, listed in _METHODS.items():
            if isinstance(owner, kind) and node.attr in listed:
                method = getattr(kind, node.attr)
                plain = _listed(method) if node.attr in ("items", "keys", "values") else method
                return lambda *values, **options: plain(owner, *values, **options)
        return None

    def _listcomp(self, node: ast.ListComp | ast.GeneratorExp) -> list[Any]:
        kept = dict(self._bound)
        found = [self.value(node.elt) for _ in self._bindings(node.generators)]
        self._bound = kept
        return found

    def _bindings(self, generators: list[ast.comprehension]) -> Iterator[None]:
        """Once for every item, with the names of the comprehension bound to it."""
        if not generators:
            yield
            return
        first, *others = generators
        for item in list(self.value(first.iter)):
            self._bind(first.target, self._bounded(item))
            if all(self.value(condition) for condition in first.ifs):
                yield from self._bindings(others)

    def _bind(self, target: ast.expr, item: Any) -> None:
        if isinstance(target, ast.Name):
            self._bound[target.id] = item
            return
        if not isinstance(target, ast.Tuple):
            raise self._refused(type(target).__name__)
        for each, value in zip(target.elts, item, strict=True):
            self._bind(each, self._bounded(value))


_KINDS: dict[type, Callable[[_Walk, Any], Any]] = {
    ast.Constant: _Walk._constant,
    ast.Name: _Walk._name,
    ast.List: _Walk._list,
    ast.Tuple: _Walk._tuple,
    ast.IfExp: _Walk._ifexp,
    ast.BoolOp: _Walk._boolop,
    ast.UnaryOp: _Walk._unaryop,
    ast.BinOp: _Walk._binop,
    ast.Compare: _Walk._compare,
    ast.Subscript: _Walk._subscript,
    ast.Attribute: _Walk._attribute,
    ast.Call: _Walk._call,
    ast.ListComp: _Walk._listcomp,
    ast.GeneratorExp: _Walk._listcomp,
}


def _functions(functions: Mapping[str, Any]) -> Iterator[Any]:
    for each in functions.values():
        if isinstance(each, NameSpace):
            yield from _functions(each)
        elif callable(each):
            yield each


def _is_scope(value: Any) -> bool:
    """Whether it is a table of properties of xacro: of an included file with a namespace."""
    return isinstance(value, dict) and hasattr(type(value), "_resolve_")
