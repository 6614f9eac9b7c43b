"""YAML of configs: plain values within limits, so that a foreign file can neither run code nor
fill memory nor take forever.

Aliases are refused (they make small files huge), and so are merge keys (<<), tags beyond the safe
ones, keys given twice, deep nesting and numbers of more digits than any number has: Python turns
long digits into a number in quadratic time. Parsed by libyaml where it is there.
"""

from functools import lru_cache
from typing import Any

import yaml

from excite_cli.errors import ConfigError

MAX_DEPTH = 30
MAX_VALUES = 50_000  # words and numbers; a large config has a thousand
LONGEST_NUMBER = 100  # characters
_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_MERGE = "tag:yaml.org,2002:merge"
_LONGEST_PROBLEM = 200
_SHORT = 20_000  # characters that PyYAML's own parser takes well under a second for


def load_strict(text: str, source: str) -> Any:
    """The only document of `text` as plain values; `source` is named in messages.

    Raises
    ------
    ConfigError
        It is not YAML, or is more than plain values.
    """
    try:
        node = composed(text)
        _check(node)
        return None if node is None else yaml.constructor.SafeConstructor().construct_document(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f", line {mark.line + 1}" if mark else ""
        problem = str(error.problem)[:_LONGEST_PROBLEM]
        raise ConfigError(f"{source}{where}: not valid YAML: {problem}") from error
    # Values that Python's own types refuse, as the day 2001-99-99, lead to other errors.
    except (yaml.YAMLError, RecursionError, ValueError, TypeError, ArithmeticError) as error:
        problem = str(error)[:_LONGEST_PROBLEM]
        raise ConfigError(f"{source}: not valid YAML: {problem}") from error


@lru_cache(maxsize=2)
def composed(text: str) -> yaml.Node | None:
    """The tree of nodes, each with its place in the text; nothing for an empty text.

    Raises
    ------
    yaml.YAMLError
        It is not YAML, has aliases, holds too much, or is nested too deeply.
    """
    try:
        return _composed(text, _PARSER)
    except yaml.YAMLError:
        if _PARSER is yaml.SafeLoader or len(text) > _SHORT:
            raise
    return _composed(text, yaml.SafeLoader)  # says better what is wrong, and where it began


def _composed(text: str, parser: Any) -> yaml.Node | None:
    depth = count = 0
    for event in yaml.parse(text, Loader=parser):
        count += isinstance(event, yaml.ScalarEvent)
        if count > MAX_VALUES:
            raise _wrong(f"more than {MAX_VALUES:,} words and numbers", event)
        if isinstance(event, yaml.AliasEvent):
            raise _wrong("aliases (*) are not allowed", event)
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise _wrong(f"nested deeper than {MAX_DEPTH} levels", event)
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
    node: yaml.Node | None = yaml.compose(text, Loader=parser)
    return node


def _check(node: yaml.Node | None) -> None:
    """Refuse keys given twice or that are no words, and numbers that are too long."""
    todo = [] if node is None else [node]
    while todo:
        at = todo.pop()
        if isinstance(at, yaml.SequenceNode):
            todo.extend(at.value)
        elif isinstance(at, yaml.MappingNode):
            seen = set()
            for key, value in at.value:
                if not isinstance(key, yaml.ScalarNode):
                    raise _wrong("a key must be a plain word", key)
                if key.value in seen:
                    raise _wrong(f"key '{key.value[:60]}' is given twice", key)
                if key.tag == _MERGE:  # without aliases of no use; they would change the tree
                    raise _wrong("merge keys (<<) are not allowed; write the values out", key)
                seen.add(key.value)
                todo += [key, value]
        elif at.tag in _NUMBERS and len(at.value) > LONGEST_NUMBER:
            raise _wrong(f"a number of {len(at.value)} characters", at)


def _wrong(problem: str, where: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(None, None, problem, where.start_mark)
