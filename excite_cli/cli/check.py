"""`excite check`: every motion of a file against every constraint, by other means."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.geometry.words import standing_in_words

if TYPE_CHECKING:
    from excite_cli.excitation.inspection import Inspection
    from excite_cli.excitation.problem import Problem
    from excite_cli.proof.certificate import Path as MotionPath
    from excite_cli.trajectory.chain import Segment

# Stored samples may differ from the motion by rounding only.
_SAME = 1e-6


def check(
    config: options.Config,
    file: options.MotionFile,
    rate: Annotated[float, typer.Option("--rate", min=1.0, help="Instants per second [Hz].")] = 1e3,
    random: Annotated[
        int, typer.Option("--random", min=0, help="Random instants beside them.")
    ] = 0,
    meshes: Annotated[
        bool, typer.Option("--meshes/--no-meshes", help="Look at the collision meshes, too.")
    ] = True,
    slow: Annotated[
        float | None,
        typer.Option(
            "--slow",
            metavar="SHARE",
            help="Judge the motions slowed to a share of the limits of speed and acceleration.",
        ),
    ] = None,
    overrides: options.Set = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Judge motions before a robot plays them: results, CSV, ROS 2, MoveIt, NumPy, measured data.

    Margins are taken at controller rate (and at random instants); distances of capsules are
    measured a second time by Pinocchio and coal. Between the instants every constraint is proved
    with bounds that share nothing with the optimiser's kinematics; the collision meshes are looked
    at by Pinocchio and coal, too. A verdict is `proved` (at every instant), `sampled` (no
    violation seen, with the reason why it is not proved) or `BROKEN`. Exit status 1: something is
    broken.

    Examples:
      excite check ur10.yaml ur10.h5
      excite check ur10.yaml ur10.h5 --random 10000 --json
    """
    from excite_cli.cli.motions import load_motions
    from excite_cli.cli.setup import load_problem, single_threaded
    from excite_cli.errors import FileError
    from excite_cli.excitation.admissible import path_of
    from excite_cli.excitation.inspection import Look, inspect, mesh_check_of

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if not file.exists():
        raise FileError(f"There is no file {file}.")
    with single_threaded():
        problem = load_problem(terminal, config, overrides)
        segments = load_motions(terminal, file, problem.robot, problem.spec)
        _require_same_trajectory(file, config, problem)
        checker = mesh_check_of(problem) if meshes else None
        look = Look(rate, random, problem.spec.seed)
        data, found = [], []
        with terminal.live("", len(segments)) as show:
            for index, segment in enumerate(segments, start=1):
                show(f"motion {index}/{len(segments)}", index - 1)
                played = _slowed(terminal, problem, segment, slow)
                path = path_of(problem, played.trajectory, played.coefficients)
                inspection = inspect(problem, path, checker, look)
                off = _mismatch(problem, file, index, path) if slow is None else (0.0, 0.0)
                found.append((segment.name, inspection, off))
                data.append(_data(index, segment.name, inspection, off))
    broken = sum(motion["violations"] for motion in data)
    title = f"margins at {rate:g} Hz" + (f" and {random} random instants" if random else "")
    notes = [note for name, inspection, off in found for note in _notes(name, inspection, off)]
    alarms = [words for name, inspection, _ in found for words in _alarms(name, inspection)]
    summary = f"{broken} violations" if broken else "No violation."
    caption = "A margin is what is left beyond what the config asks to keep."
    terminal.answer(
        [*alarms, *_tables(found, title), caption, *notes, *_agreement(found), summary],
        {"file": str(file), "ok": not broken, "motions": data, "rate": rate, "random": random,
         "slow": slow},
    )  # fmt: skip
    if broken:
        raise typer.Exit(1)


def _require_same_trajectory(file: Path, config: Path, problem: "Problem") -> None:
    """A result must have been made with the trajectory section of the config."""
    from excite_cli.config.load import parse_spec
    from excite_cli.errors import FileError
    from excite_cli.store.result_file import is_result, read_result

    if not is_result(file):
        return
    stored = parse_spec(read_result(file).config, f"the config stored in {file}").trajectory
    if stored != problem.spec.trajectory:
        raise FileError(f"{file} has motions of another trajectory section than {config}.")


def _slowed(
    terminal: Terminal, problem: "Problem", segment: "Segment", share: float | None
) -> "Segment":
    from dataclasses import replace

    from excite_cli.excitation.time_scaling import PaceLimits, slowing

    if share is None:
        return segment
    limits = PaceLimits.of(problem.constraints, problem.robot.n)
    pace = slowing(limits, segment.trajectory, segment.coefficients, share)
    terminal.say(f"{segment.name}: judged at {100 * pace:.4g} % of its pace")
    return replace(segment, trajectory=segment.trajectory.slowed(pace))


def _mismatch(
    problem: "Problem", file: Path, index: int, path: "MotionPath"
) -> tuple[float, float]:
    """By how much the samples stored in a result differ from its coefficients, and when."""
    from excite_cli.excitation.inspection import largest_mismatch
    from excite_cli.store.result_file import is_result, read_samples

    if not is_result(file):
        return 0.0, 0.0
    t, *stored = read_samples(file)[index]
    return largest_mismatch(path, t, stored)


def _data(
    index: int, name: str, inspection: "Inspection", off: tuple[float, float]
) -> dict[str, Any]:
    from excite_cli.cli.tables import worst_data

    margins = inspection.margins
    data: dict[str, Any] = {
        "index": index,
        "name": name,
        "margins": {key: worst.margin for key, worst in margins.items()},
        "worst": {key: worst_data(worst) for key, worst in margins.items()},
        "violations": inspection.violations + (off[0] > _SAME),
        "certified": inspection.certified,
        "verdicts": {
            key: {"state": state, "reason": reason}
            for key, (state, reason) in inspection.states.items()
        },
        "samples_differ": {"share": off[0], "time": off[1]},
    }
    data["second_path"] = {
        each.name: {
            "instants": each.instants,
            "of": each.of,
            "difference": each.difference,
            "unit": each.unit,
            "where": each.label,
            "time": each.time,
            "agrees": each.agrees,
        }
        for each in inspection.second
    }
    if inspection.meshes is not None:
        gaps, times = inspection.meshes.gaps, inspection.meshes.times
        data["meshes"] = {
            "pairs": gaps.pairs,
            "beyond": gaps.beyond,
            "near": [
                {
                    "links": [gap.first, gap.second],
                    "distance": gap.distance,
                    "time": float(times[gap.index]),
                    "touching": gap.touching,
                    "not_judged": standing_in_words(gap.standing),
                }
                for gap in gaps.near
            ],
            "always_in_contact": [list(pair) for pair in gaps.always],
        }
    return data


def _tables(found: "list[tuple[str, Inspection, tuple[float, float]]]", title: str) -> list[Any]:
    """One table for each motion."""
    from excite_cli.cli.layout import table as new_table

    names = ("constraint", "margin", "unit", "where", "time [s]", "verdict")
    tables = []
    for name, inspection, _ in found:
        table = new_table(
            f"{name}: worst {title}", names, ("constraint", "unit", "verdict"), ("where",)
        )
        for key, (state, _) in inspection.states.items():
            worst = inspection.margins[key]
            row = [f"{worst.margin:.5f}", worst.unit, worst.label, f"{worst.time:.4f}"]
            table.add_row(key, *row, "BROKEN" if state == "broken" else state)
        tables.append(table)
    return tables


def _alarms(name: str, inspection: "Inspection") -> list[str]:
    """Constraints of which two computations differ."""
    return [
        f"{name}: BROKEN: {each.name} of {each.label} at {each.time:.4f} s: the program's own "
        f"margin and that of Pinocchio and coal differ by {each.difference:.2g} {each.unit}. One "
        "of them is wrong: trust neither, play nothing, and report this with the config."
        for each in inspection.disagreeing
    ]


def _agreement(found: "list[tuple[str, Inspection, tuple[float, float]]]") -> list[str]:
    """By how much the two computations of distances differ at most, over all motions."""
    paths = [each for _, inspection, _ in found for each in inspection.second]
    lines = []
    for name in dict.fromkeys(each.name for each in paths):
        of = [each for each in paths if each.name == name]
        most = max(of, key=lambda each: each.difference)
        lines.append(
            f"{name}: margin by Pinocchio and coal at {sum(each.instants for each in of)} of "
            f"{sum(each.of for each in of)} instants, the lowest among them; the program's own "
            f"differs by at most {most.difference:.1g} {most.unit}."
        )
    return lines


def _notes(name: str, inspection: "Inspection", off: tuple[float, float]) -> list[str]:
    """Why something is not proved, and what else one should know."""
    notes = [
        f"{name}: {key} is not proved: {reason}."
        for key, (state, reason) in inspection.states.items()
        if state == "sampled"
    ]
    if inspection.meshes is not None:
        notes += [
            f"{name}: meshes of {gap.first} and {gap.second} touch; not judged "
            f"({standing_in_words(gap.standing)})."
            for gap in inspection.meshes.told
        ]
    if off[0] > _SAME:
        notes.append(
            f"{name}: BROKEN: the samples stored in the file differ from its coefficients by "
            f"{off[0]:.2g} of the largest value at {off[1]:.4f} s; someone changed one of them."
        )
    return notes
