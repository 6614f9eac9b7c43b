"""The files that an MJCF reads: what it includes, and meshes, textures and height fields."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

_FOLDERS = ("meshdir", "texturedir", "assetdir")
_MOST = 2000  # files; beyond, nobody vouches for what is kept


def mjcf_sources(path: Path, text: str) -> tuple[Path, ...] | None:
    """Every file that may be meant, in the order of their names; None where that is not sure.

    MuJoCo looks for files beside the main file or in a folder that <compiler> names; here all that
    a name may mean are taken.
    """
    texts, todo = {path: text}, [path]
    names: set[str] = set()
    folders = {"."}
    while todo:
        file = todo.pop()
        try:
            root = ElementTree.fromstring(texts[file])
        except ElementTree.ParseError:
            return None
        for element in root.iter():
            folders |= {element.get(key, ".") for key in _FOLDERS}
            names |= {value for key, value in element.attrib.items() if key.startswith("file")}
            if element.tag in ("model", "attach"):  # of other models, each with its own folders
                return None
            if element.tag != "include":
                continue
            for beside in {path.parent, file.parent}:
                other = beside / element.get("file", "")
                if other in texts or not other.is_file():
                    continue
                try:
                    texts[other] = other.read_text(encoding="utf-8")
                except (OSError, UnicodeDecodeError):
                    return None
                todo.append(other)
        if len(texts) + len(names) > _MOST:
            return None
    places = {beside / folder for beside in {each.parent for each in texts} for folder in folders}
    # An absolute folder or name stands alone, whatever it is joined to.
    found = {place / name for place in places for name in names}
    return tuple(sorted(each for each in {*texts, *found} if each.is_file()))
