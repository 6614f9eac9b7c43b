"""Plain YAML data of others: numbers, texts, lists and mappings, and nothing else.

Built straight from the parser's events (libyaml's where it is there): no tags, no aliases, limited
depth, so that a foreign file can neither run code nor grow in memory, and files of a million
numbers take seconds.
"""

import re
from typing import Any

import yaml

from excite_cli.errors import FileError

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
