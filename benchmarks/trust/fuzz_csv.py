"""Text tables: spoiled samples, headers, separators, lines and bytes; bombs in `.gz`."""

import gzip
from pathlib import Path

import numpy as np

from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_number,
    odd_text,
    pick,
    spoiled_bytes,
    spoiled_text,
)
from benchmarks.trust.fuzz_recordings import (
    JOINTS,
    enter_data,
    enter_motion,
    odd_samples,
    recorded,
)
from benchmarks.trust.fuzz_trial import Fuzzer
from excite_cli.measurement.dataset import Array

_WORDS = (
    b",",
    b";",
    b"\t",
    b" ",
    b'"',
    b"nan",
    b"inf",
    b"-inf",
    b"1e999",
    b"0x1p3",
    b"1_0",
    b"#",
    b"%",
    b"\r",
    b"\r\n",
    b"1,5",
    b"none",
    b",,,,",
    b"'",
    b"\x0b",
    b"\x1c",
    b"\x85",
)


class CsvFuzzer(Fuzzer):
    """CSV."""

    name = "csv"

    def open(self, bases: Path) -> None:
        """One recording, for all."""
        self._data = recorded(np.random.default_rng(0))

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled table."""
        path = folder / pick(rng, ("log.csv",) * 6 + ("log.tsv", "log.txt", "log.csv.gz"))
        way = int(rng.integers(20))
        if way < 7:
            made, data = "samples", _table(rng, odd_samples(rng, self._data))
        elif way < 9:
            made, data = "header", _table(rng, self._data, odd_header=True)
        elif way < 14:
            made, data = "text", spoiled_text(rng, _table(rng, self._data), _WORDS)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, _table(rng, self._data))
        else:
            made, data = _hostile(rng)
        if path.suffix == ".gz":
            data = gzip.compress(data, 1)
            if chance(rng, 0.4):
                data = spoiled_bytes(rng, data)
        path.write_bytes(data)
        return path, made

    def enter(self, path: Path) -> None:
        """As measured data if it has torques, else as a motion."""
        if not enter_motion(path):
            enter_data(path)


def _table(rng: Rng, data: dict[str, Array], odd_header: bool = False) -> bytes:
    separator = pick(rng, (",", ",", ",", ";", "\t", " "))
    names = list(JOINTS) if chance(rng, 0.7) else ["1", "2", "3"]
    channels = [c for c in ("q", "dq", "tau") if c != "dq" or chance(rng, 0.7)]
    if chance(rng, 0.15):
        channels = ["q", "dq", "ddq"]
        data = {**data, "ddq": data["tau"]}
    header = ["t"] + [f"{channel}_{name}" for channel in channels for name in names]
    columns = [data["t"], *(column for channel in channels for column in data[channel].T)]
    if odd_header:
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(header)))
            header[at] = pick(
                rng,
                (
                    odd_text(rng),
                    header[int(rng.integers(len(header)))],
                    "q_",
                    "q[0]",
                    "tau999999999999999999999",
                    "q_q_q",
                    "tau_tau_1",
                    "dq_",
                    "t_1",
                ),
            )
    rows = [separator.join(header)] if chance(rng, 0.97) else []
    form = pick(rng, ("%r", "%.6g", "%.3f"))
    rows += [separator.join(form % float(x) for x in row) for row in np.column_stack(columns)]
    if chance(rng, 0.1):
        rows = [row.replace(".", ",") for row in rows]
    return (
        pick(rng, ("\n", "\n", "\r\n", "\r"))
        .join(rows)
        .encode(pick(rng, ("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1")), "replace")
    )


def _hostile(rng: Rng) -> tuple[str, bytes]:
    size = int(10 ** rng.uniform(1, 6))
    way = int(rng.integers(12))
    if way == 0:
        return "wide header", ",".join(
            f"q_{k}" for k in range(min(size, 150_000))
        ).encode() + b"\n1"
    if way == 1:
        return "long line", b"t,q_1,tau_1\n" + b"1" * size
    if way == 2:
        return "blank", pick(rng, (b"", b"\n", b" ", b"\0", b",", b"#\n", b"\xef\xbb\xbf")) * size
    if way == 3:
        return "ragged", b"t,q_1,tau_1\n" + b"1,2\n1,2,3,4\n" * min(size, 20_000)
    if way == 4:
        return "quotes", b't,q_1,tau_1\n"' + b'"",' * size
    if way == 5:
        return "one column", b"q_1\n" + b"1\n" * min(size, 100_000)
    if way == 6:
        number = repr(odd_number(rng)).encode()
        return "constant", b"t,q_1,q_2,q_3,tau_1,tau_2,tau_3\n" + (
            b",".join([number] * 7) + b"\n"
        ) * 30
    if way == 7:
        return "binary", bytes(rng.integers(0, 256, size, dtype=np.uint8))
    if way == 8:
        return "header only", b"t,q_shoulder,q_elbow,q_wrist,tau_shoulder,tau_elbow,tau_wrist\n"
    if way == 9:
        wide = ",".join(f"c{k}" for k in range(min(size, 60_000)))
        return "wide columns", f"t,q_1,tau_1,{wide}\n0,0,0\n".encode()
    if way == 10:
        return "zeros packed", b"t,q_1,tau_1\n" + b"0,0,0\n" * min(10 * size, 400_000)
    digits = b"1" * size
    return "long number", b"t,q_1,tau_1\n0,0,0\n1," + digits + b",1e" + digits[:400] + b"\n"
