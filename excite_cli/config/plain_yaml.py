"""YAML of plain values, within limits: data of others, and configs.

Built straight from the parser's events (libyaml's where it is there): no tags, no aliases, limited
depth, so that a foreign file can neither run code nor grow in memory, and files of a million
numbers take seconds.
"""

import re
from functools import lru_cache
from typing import Any

import yaml

from excite_cli.errors import ConfigError, FileError

# Plain values as YAML text that people can read and this program loads again.


class _Dumper(yaml.SafeDumper):
    """Safe dumper without aliases: the loader refuses them."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write a value twice rather than refer to it."""
        return True


def yaml_text(tree: dict[str, Any], comment: str = "") -> str:
    """YAML of dictionaries, lists, texts and numbers, in their order, after a `comment`."""
    lines = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    text = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return lines + str(text)


MAX_DEPTH = 30
_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_WORDS = {"null": None, "~": None, "": None, "true": True, "false": False}
# Numbers by YAML 1.2: `1e-05`, as Python prints it, is one too.
_WHOLE = re.compile(r"[-+]?\d+$")


def parse_plain(text: str, source: str) -> Any:
    """The first document of `text`; `source` is named in messages.

    Raises
    ------
    FileError
        It is not YAML, is nested too deeply, or has aliases, tags or a key twice.
    """
    try:
        return _built(text, source)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f", line {mark.line + 1}" if mark else ""
        raise FileError(f"{source}{where}: not valid YAML: {error.problem}.") from error
    except (yaml.YAMLError, ValueError) as error:
        raise FileError(f"{source}: not valid YAML: {error}.") from error


def _built(text: str, source: str) -> Any:
    root: list[Any] = []
    stack: list[Any] = [root]
    keys: list[Any] = [None]  # of each open collection: the key that waits for its value
    event: Any
    for event in yaml.parse(text, Loader=_PARSER):
        kind = type(event)
        tag = getattr(event, "tag", None)
        if tag is not None and tag != "!":
            raise _error(source, event, f"tags ({tag}) are not allowed")
        if kind is yaml.ScalarEvent:
            value = _scalar(event)
        elif kind is yaml.SequenceStartEvent:
            value = []
        elif kind is yaml.MappingStartEvent:
            value = {}
        elif kind in (yaml.SequenceEndEvent, yaml.MappingEndEvent):
            stack.pop()
            keys.pop()
            continue
        elif kind is yaml.AliasEvent:
            raise _error(source, event, "aliases (*) are not allowed")
        elif kind is yaml.DocumentEndEvent:
            break
        else:
            continue
        if len(stack) > MAX_DEPTH:
            raise _error(source, event, f"nested deeper than {MAX_DEPTH} levels")
        holder = stack[-1]
        if isinstance(holder, list):
            holder.append(value)
        elif keys[-1] is None:
            if kind is not yaml.ScalarEvent:
                raise _error(source, event, "a key must be a plain word")
            if event.value in holder:
                raise _error(source, event, f"key '{event.value}' is given twice")
            keys[-1] = event.value
            continue
        else:
            holder[keys[-1]] = value
            keys[-1] = None
        if kind is not yaml.ScalarEvent:
            stack.append(value)
            keys.append(None)
    return root[0] if root else None


def _scalar(event: Any) -> Any:
    word = event.value
    if not event.implicit[0]:
        return word
    try:
        return int(word) if _WHOLE.match(word) else float(word.replace(".nan", "nan"))
    except ValueError:
        return _WORDS.get(word.lower(), word)


def _error(source: str, event: Any, what: str) -> FileError:
    return FileError(f"{source}, line {event.start_mark.line + 1}: {what}.")


# YAML of configs: plain values within limits, so that a foreign file can neither run code nor
# fill memory nor take forever.
#
# Aliases are refused (they make small files huge), and so are merge keys (<<), tags beyond the safe
# ones, keys given twice, deep nesting and numbers of more digits than any number has: Python turns
# long digits into a number in quadratic time. Parsed by libyaml where it is there.

MAX_VALUES = 50_000  # words and numbers; a large config has a thousand
LONGEST_NUMBER = 100  # characters
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
