"""Text tables of numbers: separators told apart, gaps and damaged rows named with their line.

Nothing is evaluated; a line, a file and the unpacked size of a `.gz` have limits.
"""

import codecs
import csv
import gzip
import re
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.reader import (
    check_size,
    check_unpacked,
    check_values,
)

_MAX_LINE = 2**20
_BEGIN = 2**16  # bytes by which the encoding is told
_OFTEN = 4096  # rows between looks at how much it has become
_MAX_TEXT = 2 * 2**30  # unpacked
_BLANKS = frozenset({"", "nan", "na", "n/a", "null", "none", "-"})
_SEPARATOR = re.compile(r'"?sep=(.)"?$', re.IGNORECASE)  # the first line of some spreadsheets
_DECIMAL_COMMA = re.compile(r"\d,\d")


@dataclass(frozen=True)
class NamedColumns:
    """Named columns (T,) of numbers; NaN where a field was empty; `words`: columns of one word."""

    columns: dict[str, Array]
    findings: tuple[Finding, ...] = ()
    words: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Layout:
    header: list[str]
    separator: str | None  # None: white space
    decimal_comma: bool
    first_row: int  # number of lines before the first row


_OTHERS = {  # what files are that begin so
    b"\x89HDF": ("an HDF5 file", ".h5"),
    b"PAR1": ("a parquet file", ".parquet"),
    b"MATLAB ": ("a file of MATLAB", ".mat"),
}


def header_of(path: Path) -> tuple[str, ...]:
    """Names of the columns; nothing where the file is no table (reading it says why)."""
    try:
        return tuple(_layout(path).header)
    except (FileError, ValueError, csv.Error, OSError, EOFError, zlib.error):
        return ()


def _refuse_other_kind(path: Path) -> None:
    """Raise FileError where the first bytes say what a file is instead of a table."""
    with path.open("rb") as file:
        begins = file.read(8)
    for mark, (kind, suffix) in _OTHERS.items():
        if begins.startswith(mark):
            name = f"{path.stem}{suffix} (in a campaign: --log {suffix})"
            raise FileError(f"{path} is not a text table: it is {kind}. Name it {name}.")


def read_table(path: Path) -> NamedColumns:
    """Read a `.csv` or `.csv.gz`; comma, semicolon, tab or white space between columns.

    Raises
    ------
    FileError
        No header, a column twice, a ragged row, a word among numbers, not text, or too large.
    """
    check_size(path)
    try:
        _refuse_other_kind(path)
        _check_unpacked(path)
        layout = _layout(path)
        findings: list[Finding] = []
        words: dict[str, str] = {}
        try:
            values = _fast(path, layout)
        except (ValueError, OverflowError):
            values, words, findings = _careful(path, layout)
    except (UnicodeError, csv.Error) as error:
        raise FileError(f"{path} is not a text table: {error}.") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise FileError(f"{path} is a damaged or cut off .gz file: {error}.") from error
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror or error}.") from error
    if layout.decimal_comma:
        text = "numbers are written with a decimal comma; read so"
        findings.append(Finding("decimal_comma", "note", text))
    return NamedColumns(values, tuple(findings), words)


def _lines(path: Path) -> Iterator[str]:
    """Lines without their ends, within limits."""
    encoding = _encoding(path)
    with (
        gzip.open(path, "rt", encoding=encoding, newline=None)
        if _is_packed(path)
        else path.open(encoding=encoding, newline=None)
    ) as file:
        total = 0
        while line := file.readline(_MAX_LINE):
            total += len(line)
            if len(line) >= _MAX_LINE or total > _MAX_TEXT:
                raise FileError(
                    f"{path}: a line of more than {_MAX_LINE // 2**20} MiB, or more than "
                    f"{_MAX_TEXT // 2**30} GiB of text. Cut it into several runs."
                )
            yield line.rstrip("\n")


def _encoding(path: Path) -> str:
    """UTF-16 by its mark; UTF-8 where the beginning is; else that of Western spreadsheets."""
    with gzip.open(path, "rb") if _is_packed(path) else path.open("rb") as file:
        begin = file.read(_BEGIN)
    if begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8-sig")().decode(begin)
    except UnicodeDecodeError:
        return "utf-8-sig" if b"\0" in begin else "cp1252"
    return "utf-8-sig"


def _check_unpacked(path: Path) -> None:
    """Unpack a `.gz` once without looking at it, which is quick, before any of it is understood."""
    if not _is_packed(path):
        return
    with gzip.open(path, "rb") as file:
        total = 0
        while piece := file.read(_MAX_LINE):
            total += len(piece)
            check_unpacked(path, total)


def _is_packed(path: Path) -> bool:
    return path.name.lower().endswith(".gz")


def _layout(path: Path) -> _Layout:
    """Header and separator; a header may stand behind `#`, as numpy writes it."""
    remark, header = "", ""
    for count, line in enumerate(_lines(path)):
        if not line.strip() or (count == 0 and _SEPARATOR.match(line.strip())):
            pass
        elif line.startswith("%time"):  # of `rostopic echo -p`
            header = line
        elif line.lstrip().startswith(("#", "%")):
            remark = line.lstrip().lstrip("#% ")
        elif header:
            return _laid_out(path, header, line, count)
        elif _is_numeric(line):
            if not remark or _is_numeric(remark):
                raise FileError(
                    f"{path} has no header: its first line is '{line[:60]}'. Add a line with the "
                    "columns' names: t, q_<joint>, …, tau_<joint>, … (and dq_<joint>)."
                )
            return _laid_out(path, remark, line, count)
        else:
            header = line
    if not header:
        raise FileError(f"{path} is empty.")
    raise FileError(f"{path} has a header and no rows.")


def _is_numeric(line: str) -> bool:
    words = [word.strip().strip('"') for word in re.split(r"[,;\s]+", line.strip()) if word]
    try:
        [float(word) for word in words if word.lower() not in _BLANKS]
    except ValueError:
        return False
    return True


def _laid_out(path: Path, header: str, row: str, count: int) -> _Layout:
    separator = max((";", "\t", ","), key=header.count)
    names = _split(header, separator if separator in header else None)
    if names and not names[-1]:  # a separator at the end of each line
        names = names[:-1]
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice or not all(names):
        what = f"column '{twice[0]}' is there twice" if twice else "a column has no name"
        raise FileError(f"{path}: {what}. Give every column its own name in the header.")
    used = separator if separator in header else None
    comma = used != "," and bool(_DECIMAL_COMMA.search(row)) and "." not in row
    return _Layout(names, used, comma, count)


def _split(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=separator))]


def _rows(path: Path, layout: _Layout) -> Iterator[str]:
    for number, line in enumerate(_lines(path)):
        if number % _OFTEN == 0:
            check_values(path, number * len(layout.header))
        if number >= layout.first_row and line.strip() and not line.lstrip().startswith(("#", "%")):
            yield line.replace(",", ".") if layout.decimal_comma else line


def _fast(path: Path, layout: _Layout) -> dict[str, Array]:
    """All rows whole and all fields numbers, by numpy's own parser."""
    width = len(layout.header)
    rows = _rows(path, layout)
    table = np.loadtxt(rows, delimiter=layout.separator, ndmin=2, comments=None, quotechar='"')
    if table.shape[1] != width:
        raise ValueError("another number of columns")
    check_values(path, table.size)
    return {name: np.ascontiguousarray(table[:, j]) for j, name in enumerate(layout.header)}


def _careful(path: Path, layout: _Layout) -> tuple[dict[str, Array], dict[str, str], list[Finding]]:
    """Row by row: empty fields become NaN, dates seconds; a cut last row is left out.

    Columns of words are left out, too; where they are all the same, the word is known.
    """
    width, fields, findings, numbers = len(layout.header), [], [], []
    first = layout.first_row
    for number, line in enumerate(_lines(path)):
        if number < first or not line.strip() or line.lstrip().startswith(("#", "%")):
            continue
        row = _split(line.replace(",", ".") if layout.decimal_comma else line, layout.separator)
        if len(row) == width + 1 and not row[-1]:
            row = row[:-1]
        fields.append(row)
        numbers.append(number + 1)
        check_values(path, len(fields) * width)
    if fields and len(fields[-1]) < width:
        text = f"the last row (line {numbers[-1]}) is cut off and left out: {len(fields[-1])} of "
        findings.append(Finding("truncated", "warning", text + f"{width} fields"))
        fields.pop()
    for row, number in zip(fields, numbers, strict=False):
        if len(row) != width:
            raise FileError(
                f"{path}, line {number}: {len(row)} fields, but the header names {width} columns. "
                "Correct or delete that line."
            )
    if not fields:
        raise FileError(f"{path} has a header and no whole rows.")
    columns: dict[str, Array] = {}
    words: list[str] = []
    same: dict[str, str] = {}
    for name, texts in zip(layout.header, zip(*fields, strict=True), strict=True):
        values = _numbers(texts)
        if isinstance(values, int):
            values = _dates(texts, values)
        if isinstance(values, int):
            if any(text and _is_numeric(text) for text in texts[:1000]):
                raise FileError(
                    f"{path}, line {numbers[values]}: '{texts[values][:40]}' in column '{name}' "
                    "is not a number. Leave the field empty where a value is missing."
                )
            words.append(name)
            if len({*texts}) == 1:
                same[name] = texts[0]
        else:
            columns[name] = values
    if words:
        text = f"columns of words are left out: {', '.join(words)}"
        findings.append(Finding("words", "note", text))
    return columns, same, findings


def _numbers(texts: tuple[str, ...]) -> Array | int:
    """The column, or the index of the first field that is no number."""
    values = np.full(len(texts), np.nan)
    for index, text in enumerate(texts):
        if text.lower() in _BLANKS:
            continue
        try:
            values[index] = float(text)
        except ValueError:
            return index
    return values


def _dates(texts: tuple[str, ...], index: int) -> Array | int:
    """Seconds since 1970 of ISO dates with a time, in UTC unless they say; or `index` again."""
    try:
        found = [datetime.fromisoformat(text) for text in texts]
    except ValueError:
        return index
    zoned = (each if each.tzinfo else each.replace(tzinfo=UTC) for each in found)
    return np.array([each.timestamp() for each in zoned])
