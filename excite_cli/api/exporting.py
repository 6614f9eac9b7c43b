"""Motions for controllers, identified models for simulators: `excite export`."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked, existing, paths_in
from excite_cli.api.exported_chains import (
    ChainRequest,
    ExportedChain,
    Start,
    chains_of,
    durations_of,
)
from excite_cli.api.model_exports import ModelRequest, write_requested
from excite_cli.api.outputs import held
from excite_cli.claim import claim, leave
from excite_cli.errors import ConfigError, FileError, nearest
from excite_cli.export.exported import MODEL_FORMATS
from excite_cli.export.held_out import HeldOutErrors
from excite_cli.export.ros2_package import is_package
from excite_cli.export.timed import timed_motion
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.catalogue import MOTION_FORMATS
from excite_cli.shown.answer import Answer, Command, as_word
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.fit_file import is_fit
from excite_cli.store.model_file import is_text
from excite_cli.summary.cells import percent
from excite_cli.summary.pairs import not_modelled_in_words


@dataclass(frozen=True)
class ExportedMotion:
    """A motion as it was written: `duration` [s] in all, `durations` of its parts.

    `pace` is the share of its own pace at which it goes. `doubt`: why it does not count as proved,
    although its file says so; empty where it may.
    """

    name: str
    path: Path
    instants: int
    duration: float
    durations: dict[str, float]
    pace: float
    doubt: str = ""


@dataclass(frozen=True)
class Exported:
    """The files that were written in `format`; of motions also what is in them.

    `rate` [Hz], and `slow`: the share of the limits that was requested. `not_modelled`: what the
    verdict on the motions does not speak of. `held_out`: errors of a URDF or an MJCF.
    """

    format: str
    paths: tuple[Path, ...]
    motions: tuple[ExportedMotion, ...] = ()
    rate: float = 0.0
    slow: float | None = None
    not_modelled: tuple[str, ...] = ()
    held_out: HeldOutErrors | None = None


@checked()
def export_file(
    file: str | Path,
    format: str,
    output: str | Path | None = None,
    *,
    chosen: Sequence[int] = (),
    rate: float = 1000.0,
    equidistant: bool = False,
    periods: int = 1,
    slow: float | None = None,
    start: Start | None = None,
    thresholds: str | Path | None = None,
    samples: int | None = None,
    seed: int | None = None,
    allow_unproved: bool = False,
    lead: bool = False,
    overwrite: bool = False,
    tell: Tell = log_note,
) -> Exported:
    """Write motions for controllers, or a model for simulators, in C or for ROS 2: `excite export`.

    `file` is a result, a motion in a controller's format, or a model (a fit, a diagnosis, a config
    with its numbers). Formats of motions are `csv`, `ros2`, `rosbag2`, `mcap`, `moveit`, `npz` and
    those of packages, of models `urdf`, `mjcf`, `c`, `ros2-package` (a folder), `randomization`, of
    those whose robot follows set points `isaaclab`, `mjlab`, `bam`, and of fits `yaml`. `output` is
    by default named after `file`; several motions get their numbers before the suffix.

    Motions (`chosen` of a result's by their index) are sampled at `rate` [Hz], exact at every
    instant [s, rad, rad/s, rad/s²; m for sliding joints]; `equidistant` stretches the step so that
    all are equal up to the end. They are played `periods` times, slowed down until speeds and
    accelerations keep the share `slow` of their limits, and with `start` (position by joint [rad,
    m], the others at robot.posture) entered from rest there and left for it again.

    Motions of a result that changed since they were proved, or of an earlier version, are written
    only with `allow_unproved`. With `lead`, set points are written in place of the motions, for
    drives of `measurement.command`: they lead the motion by what these lag behind it.

    `thresholds` (JSON of `excite score --thresholds`) make a model in C a collision detector, too.
    `samples` (100) robots are drawn with `seed` (1) for `randomization`.

    Raises
    ------
    FileError
        The file is missing, or holds what the format cannot; a motion is not the one that was
        proved; an output exists.
    ConfigError, RobotError, MissingExtraError
        The format is unknown; the motion cannot be repeated; the library of a format is missing.
    NoAdmissibleMotionError
        No admissible way from `start` into a motion was found.
    """
    formats = [*MOTION_FORMATS.members, *MODEL_FORMATS]
    if format not in formats:
        raise ConfigError(
            f"--format {format}: unknown.{nearest(format, formats)} Known: {', '.join(formats)}."
        )
    if not 0.0 < rate <= 1e6:
        raise ConfigError(f"--rate {rate:g}: give instants per second, above 0 and up to 1e6 Hz.")
    if periods < 1:
        raise ConfigError(f"--periods {periods}: a motion is played once or more.")
    path, target = existing(file), Path(output) if output is not None else None
    modelled = is_fit(path) or is_diagnosis(path)
    if modelled != (format in MODEL_FORMATS) and not (format in MODEL_FORMATS and is_text(path)):
        what, own = ("a model", MODEL_FORMATS) if modelled else ("no model", MOTION_FORMATS.members)
        raise FileError(
            f"{path} is {what}: it cannot be exported as {format}. Its formats: {', '.join(own)}."
        )
    if thresholds is not None and format != "c":
        raise ConfigError(f"--thresholds: only a model in C holds them, not {format}.")
    if lead and format in MODEL_FORMATS:
        raise ConfigError("--lead: it is about set points of motions, and this is a model.")
    if format in MODEL_FORMATS:
        limits = None if thresholds is None else existing(thresholds)
        to = target or Path(f"{path.stem}{MODEL_FORMATS[format]}")
        wanted = ModelRequest(path, format, to, limits, samples, seed)
        refuse_inputs_as_outputs({"--output": to}, (path, *paths_in(limits)))
        tell(Note(Level.STEP, "writing the model, and playing it on its held-out data"))
        with _held([to], is_package if format == "ros2-package" else None, overwrite):
            errors = write_requested(wanted, tell)
        return Exported(format, (to,), held_out=errors)
    if samples is not None or seed is not None:
        raise ConfigError("--samples, --seed: only --format randomization draws samples.")
    exporter = MOTION_FORMATS.members[format]()
    step = 1.0 / rate if lead else None
    chains = chains_of(path, ChainRequest(chosen, periods, slow, start, allow_unproved, step), tell)
    paths = _paths(path, target, exporter, [each.name for each in chains])
    refuse_inputs_as_outputs({f"--output ({to})": to for to in paths}, (path,))
    with _held(paths, exporter.may_replace if exporter.folder else None, overwrite):
        motions = tuple(
            _written(each, to, exporter, rate, equidistant)
            for each, to in zip(chains, paths, strict=True)
        )
    if slow is not None:
        again = Command(("excite", "check", "CONFIG", as_word(paths[0]))).line
        text = (
            f"a slowed motion needs other torques: check what was written, `{again}`, before it "
            "is played"
        )
        tell(Note(Level.INFO, text))
    return Exported(format, tuple(paths), motions, rate, slow, chains[0].not_modelled)


def export_answer(found: Exported) -> Answer:
    """What `excite export` answers: files, and what is in them.

    Status 1 for a URDF or an MJCF that predicts held-out data no better than the URDF as given.
    """
    if not found.motions:
        return _model_answer(str(found.paths[0]), found)
    lines = tuple(
        f"{each.path}: {each.name}, {each.instants} samples, {each.duration:.5g} s"
        + (f", at {100 * each.pace:.4g}% of its planned speed" if found.slow is not None else "")
        + (f"; not proved: {each.doubt}" if each.doubt else "")
        for each in found.motions
    )
    motions = [
        {
            "motion": each.name,
            "output": str(each.path),
            "instants": each.instants,
            "duration": each.duration,
            "durations": each.durations,
            "pace": each.pace,
            "doubt": each.doubt or None,
        }
        for each in found.motions
    ]
    data = {
        "format": found.format,
        "rate": found.rate,
        "motions": motions,
        "not_modelled": list(found.not_modelled),
    }
    said = (not_modelled_in_words(found.not_modelled),) if found.not_modelled else ()
    return Answer((*lines, *said), data)


def _model_answer(path: str, found: Exported) -> Answer:
    data: dict[str, Any] = {"format": found.format, "output": path}
    errors = found.held_out
    if errors is None:
        return Answer((path,), data)
    data["held_out"] = {
        "run": errors.run, "file": errors.file, "model": errors.model, "urdf": errors.described
    }  # fmt: skip
    shares = [f"the whole model {percent(errors.model)}"]
    if errors.described is not None:
        shares.insert(0, f"the URDF as given {percent(errors.described)}")
    text = (
        f"On the held-out data ({errors.run}) it leaves {percent(errors.file)} of torque RMS, mean "
        f"over joints ({', '.join(shares)})."
    )
    if not errors.worse:
        return Answer((path, text), data)
    bad = f"{path} predicts no better than the URDF as given: do not use it. {text}"
    return Answer((bad, path), data, good=False)


def _written(
    each: ExportedChain, path: Path, exporter: MotionFormat, rate: float, equidistant: bool
) -> ExportedMotion:
    timed = timed_motion(
        each.name, each.joint_names, each.written, rate, equidistant, exporter.whole_nanoseconds
    )
    exporter.write(path, timed)
    return ExportedMotion(
        each.name,
        path,
        len(timed.t),
        timed.duration,
        durations_of(each.chain),
        each.pace,
        str(each.doubt),
    )


def _paths(file: Path, output: Path | None, exporter: MotionFormat, names: list[str]) -> list[Path]:
    """Where each motion goes; several get their numbers before the suffix."""
    base = output or Path(f"{file.stem}_{names[0]}{exporter.suffix}")
    if output is None and len(names) > 1:
        base = Path(f"{file.stem}_motion{exporter.suffix}")
    if len(names) == 1:
        return [base]
    numbers = (name.removeprefix("motion_") for name in names)
    return [base.with_name(f"{base.stem}_{number}{base.suffix}") for number in numbers]


@contextmanager
def _held(
    paths: list[Path], may_replace: Callable[[Path], bool] | None, overwrite: bool
) -> Iterator[None]:
    """As `held`; of folders (with `may_replace`) only those of its kind are replaced."""
    if may_replace is None:
        with held({f"output ({path})": path for path in paths}, overwrite):
            yield
        return
    with ExitStack() as claims:
        for path in paths:
            claim(path)
            claims.callback(leave, path)
            replaceable = may_replace(path)
            if path.exists() and not (overwrite and replaceable):
                replace = ", or replace it with --overwrite" if replaceable else ""
                raise FileError(f"{path} exists already. Give another name{replace}.")
        yield
