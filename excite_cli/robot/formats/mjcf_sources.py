"""The files that an MJCF reads, all within the folders that it may read.

Includes, models that it attaches, meshes, textures, height fields: MuJoCo looks for them beside the
main file or in a folder that <compiler> names. Here all that a name may mean are taken, before
MuJoCo sees any of them.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import AllowedFiles
from excite_cli.robot.packages import is_file

_FOLDERS = ("meshdir", "texturedir", "assetdir")
_MODELS = ("include", "model")
_MOST = 2000  # files; beyond, no one could vouch for what is kept
_MAX_BYTES = 20_000_000  # of an included file


def mjcf_sources(path: Path, text: str, allowed: AllowedFiles) -> tuple[Path, ...] | None:
    """Every file that may be meant, in the order of their names.

    None where it attaches other models: their content does not tell what becomes of them.

    Raises
    ------
    OutsideError
        One of them lies outside the folders that may be read.
    RobotError
        An included file is not XML or too large, or there are too many.
    """
    roots = {path: _root(path, text)}
    while True:
        elements = [element for root in roots.values() for element in root.iter()]
        folders = {element.get(key, ".") for element in elements for key in _FOLDERS}
        places = {file.parent / folder for file in roots for folder in folders}
        models = {
            name for element in elements if element.tag in _MODELS for name in _names(element)
        }
        more = [each for each in _there(places, models, allowed) if each not in roots]
        if not more:
            break
        roots |= {each: _root(each, _text(each)) for each in more}
        if len(roots) > _MOST:
            raise RobotError(f"{path.name}: it includes more than {_MOST} files.")
    names = {name for element in elements for name in _names(element)}
    if len(names) > _MOST:
        raise RobotError(f"{path.name}: it names more than {_MOST} files.")
    found = {*roots, *_there(places, names, allowed)}
    attaches = any(element.tag in ("model", "attach") for element in elements)
    return None if attaches else tuple(sorted(found))


def _names(element: ElementTree.Element) -> Iterator[str]:
    """The files that an element names: `file`, and `fileright` and its like of a sky."""
    return (value for key, value in element.attrib.items() if key.startswith("file"))


def _there(places: set[Path], names: set[str], allowed: AllowedFiles) -> Iterator[Path]:
    """The files that names mean in places; an absolute one stands alone, whatever it is joined to.

    MuJoCo also takes the last part of a name alone (strippath).
    """
    for place in sorted(places):
        for name in sorted(names):
            for inside in dict.fromkeys((name, Path(name.replace("\\", "/")).name)):
                if inside and is_file(place / inside):
                    allowed.require(place / inside)
                    yield place / inside


def _text(path: Path) -> str:
    if path.stat().st_size > _MAX_BYTES:
        raise RobotError(f"{path} is larger than {_MAX_BYTES // 10**6} MB.")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} cannot be read as text: {error}") from error
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RobotError(f"{path} declares a document type or entities; an MJCF needs neither.")
    return text


def _root(path: Path, text: str) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise RobotError(f"{path} is not well-formed XML: {error}") from error
