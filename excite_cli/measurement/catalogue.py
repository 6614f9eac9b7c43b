"""Readers of measured files, and the one way from files to a `Dataset`."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError, FileError, nearest
from excite_cli.given_files import require_stored
from excite_cli.measurement.arrange import arrange, check_names, listed
from excite_cli.measurement.base_channel import channels_of_base
from excite_cli.measurement.covariates import DeclaredCovariates
from excite_cli.measurement.csv_reader import run_of_table
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run
from excite_cli.measurement.joined_files import is_part, with_joined
from excite_cli.measurement.missing_values import known_stamps
from excite_cli.measurement.motors import Motors
from excite_cli.measurement.quality import checked
from excite_cli.measurement.reader import SINCE_1970, RawRun, Reader, ReadOptions
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.measurement.run_identity import Origin
from excite_cli.measurement.text_table import NamedColumns
from excite_cli.measurement.torque import SECONDS, check_joints, check_motors, declared, to_joints
from excite_cli.measurement.torque_sources.catalogue import torque_source
from excite_cli.out_of_core import Spool
from excite_cli.registry import Registry
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

READERS: Registry[Reader] = Registry(
    "reader",
    "excite.readers",
    Reader,
    {
        "HDF5": "hdf5_reader:Hdf5Reader",
        "CSV": "csv_reader:CsvReader",
        "ROS bag": "bag_reader:BagReader",
        "MATLAB": "mat_reader:MatReader",
        "parquet (also LeRobot folders)": "parquet_reader:ParquetReader",
    },
    ("title", "suffixes"),
)
_EPOCH = 1e6  # s: stamps beyond count from 1970, not from the start


def read_dataset(
    given: Sequence[Path] | Dataset,
    spec: MeasurementSpec,
    joint_names: tuple[str, ...],
    limits: tuple[Array, Array, Array, Array] | None = None,
    revolute: Array | None = None,
    motors: Motors | None = None,
    rows: Collection[str] = ("joints",),
) -> Dataset:
    """Read measured files, or data that are `as_given`, as one data set, converted and checked.

    `limits`: lower, upper, velocity, effort of the moved joints, (n,) each, infinite where there is
    none. `revolute` (n,): which joints turn (default all); angles in degrees are theirs. `motors`:
    those that drive several joints together. `rows` are those of the robot that are measured
    (`robot.rows`): without "joints" no torques of joints are read, as if all were `without_torque`;
    with "base" the channels of the base must be there.

    Findings of severity `error` are returned with the others; `quality.raise_for_errors` turns
    them into an exception.

    Raises
    ------
    FileError
        A file is missing, damaged, of no known format, or lacks what is needed.
    ConfigError
        `spec` names what neither robot nor file has.
    MissingExtraError
        A bag or parquet, and the library for it is not installed.
    """
    paths = () if isinstance(given, Dataset) else given
    if not isinstance(given, Dataset) and not paths:
        raise FileError("No measured file is given.")
    places = joint_names if motors is None else (*joint_names, *motors.places)
    check_names(spec.names, places)
    check_names(spec.torque_names, places, "torque_names")
    source, torques = torque_source(spec), "joints" in rows
    if not torques:
        spec = spec.model_copy(update={"without_torque": joint_names, "coupling": {}})
    check_joints(spec, joint_names, torques)
    if motors is not None:
        check_motors(spec, motors)
    turning = np.ones(len(joint_names), bool) if revolute is None else np.asarray(revolute, bool)
    known = (
        RecordingLimits(*limits, turning)
        if limits is not None
        else replace(RecordingLimits.unknown(len(joint_names)), revolute=turning)
    )
    channels: dict[str, str | None] = {str(key): name for key, name in spec.channels.items()}
    options = ReadOptions(
        joint_names, spec.names, channels, spec.rate, spec.topic,
        source.channels if torques else (),
        channels_of_base(spec) if "base" in rows else (),
    )  # fmt: skip
    findings: list[Finding] = declared(spec, joint_names, motors)
    findings += given.findings if isinstance(given, Dataset) else ()
    runs: list[Run] = []
    taken: set[str] = set()
    seen: set[str] = set()
    covariates, spool = DeclaredCovariates(spec.covariates, options.is_apart), Spool()
    noted: list[list[Finding]] = []

    def arranged() -> Iterator[tuple[Path, list[Run]]]:
        for path, raws in _recordings(given, options):
            seen.update(name for raw in raws for column in raw.columns.values() for name in column)
            own, noticed = [], []
            for raw in _named(raws, path, taken):
                raw = raw if motors is None else motors.renamed(raw, spec)
                run, more = arrange(
                    raw, joint_names, spec.names, str(path), spec.without_torque,
                    spec.torque_names, options.beside,
                )  # fmt: skip
                t, epoch = _seconds(raw, spec)
                origin = Origin(str(path) if paths else "", raw.place)
                run = replace(run, t=t, epoch=epoch, origin=origin)
                run = covariates.take(run, raw, spec.names)
                own.append(to_joints(run, spec, joint_names, turning, motors).kept(spool))
                noticed += more
            noted.append(noticed)
            yield path, own

    of_files = each(_checked, (spec, joint_names, known), arranged())
    for number, (parts, more) in enumerate(of_files):
        runs += [run.kept(spool) for run in parts]
        findings += [*noted[number], *more]
    _check_all_met(spec.names, seen)
    findings += covariates.check()
    findings = [each for each in findings if not _moves_elsewhere(each, runs, joint_names)]
    return Dataset(joint_names, tuple(runs), tuple(map(str, paths)), tuple(findings))


def _moves_elsewhere(found: Finding, runs: Sequence[Run], joint_names: tuple[str, ...]) -> bool:
    """Whether a joint that one file holds still moves in another: it was held there."""
    if found.kind != "dead" or len(found.joints) != 1:
        return False
    j = joint_names.index(found.joints[0])
    return any(np.ptp(run.q[:, j]) > 0.0 for run in runs)


def _recordings(
    given: Sequence[Path] | Dataset, options: ReadOptions
) -> Iterator[tuple[Path, list[RawRun]]]:
    """What the files hold, one after the other; those with some channels of a recording are joined.

    Of one recording only: which file belongs to which of several cannot be known. It takes the
    place of the first.
    """
    if isinstance(given, Dataset):  # as the tables that they would be in files
        place = Path("data from Python")
        for run in given.runs:
            raw = run_of_table(place, NamedColumns(run.extra), options)
            yield from with_joined([(place, [replace(raw, name=run.name)])], options)
        return
    later: list[tuple[Path, list[RawRun]]] = []
    for path in given:
        raws = reader_for(path).read(path, options)
        if later or any(is_part(raw, options) for raw in raws):
            later.append((path, raws))
        else:
            yield path, raws
    yield from with_joined(later, options)


def _checked(
    about: tuple[MeasurementSpec, tuple[str, ...], RecordingLimits],
    task: tuple[Path, list[Run]],
    tell: Tell,
) -> tuple[list[Run], list[Finding]]:
    """The runs of a file, checked; errors name the file beside the run."""
    path, runs = task
    try:
        return checked(runs, *about)
    except FileError as error:
        raise FileError(f"{path}: {error}") from error


def reader_for(path: Path) -> Reader:
    """The reader of a file, by its name.

    Raises
    ------
    FileError
        There is no such file, or no reader for it.
    """
    require_stored(path)
    for kind in READERS.foreign_first:
        if (reader := kind()).recognises(path):
            return reader
    known = "; ".join(
        f"{title}: {', '.join(reader.suffixes)}" for title, reader in READERS.members.items()
    )
    what = "is of no known format"
    if path.is_dir():
        what = "is a folder without a bag or a dataset of LeRobot"
    raise FileError(
        f"{path} {what}. Read are {known}. Other formats: export them to HDF5 or CSV; pickles are "
        "never opened."
    )


def _named(raws: list[RawRun], path: Path, taken: set[str]) -> list[RawRun]:
    """Runs with names that no other has: the group's, or the file's; both where they clash."""
    stem = path.name.split(".")[0] or path.name
    named = []
    for raw in raws:
        wished = raw.name or stem
        name = wished if wished not in taken or not raw.name else f"{stem}:{wished}"
        count = 2
        unique = name
        while unique in taken:
            unique, count = f"{name}_{count}", count + 1
        taken.add(unique)
        named.append(replace(raw, name=unique))
    return named


def _seconds(raw: RawRun, spec: MeasurementSpec) -> tuple[Array, float | None]:
    """Stamps in seconds, and the time from 1970 to their zero, if known.

    Those counted from 1970 start at 0, to keep their digits. A clock that is declared to run slow
    or fast (`measurement.clock`) is put right.
    """
    t = np.asarray(raw.t, dtype=float)
    factor = 1.0 if raw.seconds else SECONDS[spec.time]
    known = t[known_stamps(t)]
    epoch = raw.epoch
    if len(known) and known[0] * factor > _EPOCH:
        t = t - known[0]
        if known[0] * factor > SINCE_1970:
            epoch = float(known[0] * factor)
    return t * (factor * spec.clock), epoch


def _check_all_met(names: dict[str, str], seen: set[str]) -> None:
    for name in names:
        if name not in seen:
            raise ConfigError(
                f"measurement.names: no file has a joint '{name}'.{nearest(name, seen)} "
                f"The files name: {listed(sorted(seen))}."
            )
