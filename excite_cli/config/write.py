"""Plain values as YAML text that people can read and this program loads again."""

from typing import Any

import yaml


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
