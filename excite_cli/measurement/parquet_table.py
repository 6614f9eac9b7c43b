"""Tables of parquet: columns of numbers, and lists of numbers of one length, which are matrices."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import ExciteError, FileError, MissingExtraError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.memory_limit import is_shortage, limited_memory, short_of_memory
from excite_cli.measurement.reader import check_size, check_unpacked, check_values


@dataclass(frozen=True)
class ParquetTable:
    """Columns (T,) or (T, n), NaN where a value was missing; `skipped`: names of all others."""

    columns: dict[str, Array]
    skipped: tuple[str, ...]


def read_parquet(path: Path) -> ParquetTable:
    """Read all numbers of a parquet file; dates are seconds since 1970.

    Raises
    ------
    FileError
        It is damaged, too large, has no rows, or a column twice.
    MissingExtraError
        The library for parquet is not installed.
    """
    parquet = _library()
    check_size(path)
    try:
        with limited_memory(path), parquet.ParquetFile(path) as file:
            return _read(path, file)
    except ExciteError:
        raise
    # Damaged bytes lead the library to whatever error: of its own, of memory, of encodings.
    except Exception as error:
        if is_shortage(error):
            raise short_of_memory(path) from error
        raise FileError(
            f"{path} is not a readable parquet file ({error!s:.300}). If it was being written when "
            "the program ended, it is lost."
        ) from error


def _library() -> Any:
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError(
            "Reading parquet needs the library pyarrow: pip install 'excite-cli[parquet]'"
        ) from error
    # Its allocator reserves a gibibyte of addresses when it is first used, and `limited_memory`,
    # within which that fails, counts addresses.
    pyarrow.allocate_buffer(2**20)
    return pyarrow.parquet


def _read(path: Path, file: Any) -> ParquetTable:
    names = [field.name for field in file.schema_arrow]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FileError(f"{path}: column '{twice}' is there twice. Give each its own name.")
    kinds = {field.name: field.type for field in file.schema_arrow if _is_read(field.type)}
    # Not the parts' own metadata: where they are damaged, looking at them ends the process.
    count = file.metadata.num_rows * sum(getattr(k, "list_size", 1) for k in kinds.values())
    check_values(path, count)
    check_unpacked(path, 8 * count)
    with limited_memory(path, 8 * count):
        # Several threads would each reserve addresses, which the limit counts.
        table = file.read(columns=[*kinds], use_threads=False)
        found = {name: _numbers(table.column(name).combine_chunks()) for name in kinds}
    columns = {name: values for name, values in found.items() if values is not None}
    if not columns or not table.num_rows:
        raise FileError(f"{path} has no rows of numbers; its columns: {listed(names)}.")
    return ParquetTable(columns, tuple(name for name in names if name not in columns))


def _is_read(kind: Any) -> bool:
    from pyarrow import types

    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        return types.is_integer(kind.value_type) or types.is_floating(kind.value_type)
    number = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    return number or types.is_timestamp(kind)


def _numbers(values: Any) -> Array | None:
    """The column as (T,) or (T, n) doubles; None of lists that are missing or differ in length."""
    from pyarrow import compute, types

    if not types.is_nested(values.type):
        return _doubles(values)
    lengths = compute.unique(compute.list_value_length(values)).to_pylist()
    if len(lengths) != 1 or not lengths[0] or values.null_count:
        return None
    return _doubles(values.flatten()).reshape(len(values), -1)


def _doubles(values: Any) -> Array:
    import pyarrow

    factor = 1.0
    if pyarrow.types.is_timestamp(values.type):
        values = values.cast(pyarrow.timestamp("us"), safe=False).cast(pyarrow.int64())
        factor = 1e-6
    doubles = values.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False)
    return factor * np.asarray(doubles, float)
