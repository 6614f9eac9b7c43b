"""Every robot of example-robot-data through the user's own path, without an edit.

Per robot: `excite init`, `excite optimize`, `excite check`, and the best of a few random motions.
What came of it is kept as one JSON file per robot, so that a run can be interrupted and gone on
with; the table is made of all that are there.

Run: python -m benchmarks.all_robots [--only NAME …] [--workers 2] [--resume]
     python -m benchmarks.all_robots --table-only
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path
from threading import Timer
from typing import Any

from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots, load_description
from excite_cli.robot.urdf_joints import survey

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "robots.md"
_LONGEST = 900.0  # [s] of one command
_CANDIDATES = 30
_PROGRAM = "from excite_cli.cli.app import main; main()"

Record = dict[str, Any]


def command(*arguments: str | Path, folder: Path) -> tuple[int, Any, str, float]:
    """Exit status, answer, last message and processor seconds of one `excite` command."""
    return _run([sys.executable, "-c", _PROGRAM, *map(str, arguments), "--json"], folder)


def _run(words: list[str], folder: Path) -> tuple[int, Any, str, float]:
    plain = {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env={**os.environ, **plain},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
        )
        timer = Timer(_LONGEST, process.kill)
        timer.start()
        _, status, used = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        answer, told = out.read(), err.read()
    seconds = used.ru_utime + used.ru_stime
    if process.returncode < 0:
        return process.returncode, None, f"it took longer than {_LONGEST:g} s", seconds
    last = told.strip().rpartition("\n")[2]
    message = json.loads(last)["error"] if process.returncode and last.startswith("{") else last
    try:
        return process.returncode, json.loads(answer) if answer.strip() else None, message, seconds
    except ValueError:
        return process.returncode, None, message, seconds


def examine(name: str, folder: Path) -> Record:
    """What a user sees who types the commands for one robot, and the best of random motions."""
    record: Record = {"robot": name, "seconds": {}}
    config, motion = folder / f"{name}.yaml", folder / f"{name}.h5"

    def step(verb: str, *arguments: str | Path) -> Any:
        status, answer, message, seconds = command(verb, *arguments, folder=folder)
        record["seconds"][verb] = round(seconds, 1)
        if status != 0:
            record.update(failed=verb, exit_status=status, message=message)
            return None
        return answer

    proposal = step("init", "--robot", name, "-o", config, "--overwrite")
    if proposal is None:
        return record
    record["joints"] = len(proposal["joints"])
    record["base_parameters"] = proposal["base_parameters"]
    record["not_guarded"] = not_guarded(config)
    found = step("optimize", config, "-o", motion, "--overwrite", "--no-progress")
    if found is None:
        return record
    last = found["motions"][-1]
    record["condition_number"] = last["stacked_condition_number"]
    record["status"] = last["status"]
    record["proved"] = all(last["certified"].values())
    if step("check", config, motion) is None:
        return record
    record["admissible"] = True
    return record


def not_guarded(config: Path) -> int:
    """Number of pairs of links that the proposed config leaves out."""
    from excite_cli.config.load import load_spec

    own = load_spec(config).constraints.self_collision
    return 0 if own is None else len(own.ignore)


def with_random(record: Record, folder: Path) -> Record:
    """The record with the best of a few random motions beside it."""
    config = folder / f"{record['robot']}.yaml"
    words = [sys.executable, "-m", "benchmarks.all_robots", "--random", str(config)]
    status, drawn, message, _ = _run(words, ROOT)
    return record | (drawn if status == 0 and drawn is not None else {"random_message": message})


def best_random(config: Path) -> Record:
    """The best of a few random motions, each as large as the constraints of `config` let it be."""
    from excite_cli.config.load import load_spec
    from excite_cli.excitation.problem import build_problem
    from excite_cli.excitation.random_baseline import random_baseline

    problem = build_problem(load_spec(config), config.resolve().parent)
    found = random_baseline(problem, 1, 1, _CANDIDATES, 0.0, lambda drawn, best: None)
    return {"random": found.motions[0].condition_number, "admissible_random": found.admissible}


def distinct() -> dict[str, list[str]]:
    """Robots by the first of the names that mean the same file, with the other names."""
    by_file: dict[Path, list[str]] = {}
    for name, path in example_robots().items():
        by_file.setdefault(path.resolve(), []).append(name)
    return {names[0]: names[1:] for names in by_file.values()}


def table(results: Path) -> str:
    """The markdown page of all records that are there."""
    robots = distinct()
    records = [json.loads(path.read_text()) for path in sorted(results.glob("*.json"))]
    records = [record for record in records if record["robot"] in robots]
    records.sort(key=lambda record: record["robot"].lower())
    good = [record for record in records if record.get("admissible")]
    count = sum(1 + len(robots[record["robot"]]) for record in records)
    moved = sum(1 + len(robots[record["robot"]]) for record in good)
    lines = [
        "# All robots of example-robot-data",
        "",
        "Made by `python -m benchmarks.all_robots`: for each robot `excite init --robot NAME`,",
        "then `excite optimize` and `excite check` on the config as written, nothing edited. The",
        f"random column is the best of {_CANDIDATES} random motions, each as large as the",
        "constraints let it be, as in `excite compare-random`. Seconds are processor time, one",
        "thread; those of `init` are mostly for capsules and tables of meshes, made once and kept.",
        "*Left out* counts pairs of links whose collision meshes touch, or all but touch, where",
        "the robot stands or in many postures: their meshes are too coarse or misplaced to be",
        "kept apart, the config says `NOT GUARDED` beside them, and `excite check` does not judge",
        "them.",
        f"{date.today():%d %B %Y}, a two-core server.",
        "",
        f"{moved} of {count} names ({len(good)} of {len(records)} different URDFs) give a motion",
        "that `excite check` passes with exit status 0"
        f"{'' if len(records) == len(robots) else f' ({len(robots)} URDFs in all)'}. "
        + _summary(good),
        "",
        "| robot | joints | base parameters | condition number | random | left out | init [s] "
        "| optimize [s] | outcome |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---|",
    ]
    lines += [_row(record, robots[record["robot"]]) for record in records]
    return "\n".join(lines) + "\n"


def _summary(good: list[Record]) -> str:
    def middle(values: list[float]) -> float:
        return sorted(values)[len(values) // 2] if values else float("nan")

    ratios = [r["random"] / r["condition_number"] for r in good if r.get("random")]
    total = [r["seconds"]["init"] + r["seconds"]["optimize"] for r in good]
    return (
        f"The random motion's condition number is {middle(ratios):.1f} times larger (median). "
        f"`init` and `optimize` together take {middle(total):.0f} s (median), "
        f"{max(total, default=0):.0f} s at most."
    )


def _row(record: Record, others: list[str]) -> str:
    name = record["robot"] + (f" (also {', '.join(others)})" if others else "")
    seconds = record["seconds"]
    if record.get("admissible"):
        outcome = record["status"] + ("" if record["proved"] else ", sampled in part")
    else:
        outcome = f"{record['failed']}: {_sentence(record['message'])}"
    cells = [
        name,
        record.get("joints", ""),
        record.get("base_parameters", ""),
        _figure(record.get("condition_number")),
        _figure(record.get("random")),
        record.get("not_guarded", ""),
        seconds.get("init", ""),
        seconds.get("optimize", ""),
        outcome,
    ]
    return "| " + " | ".join(str(cell).replace("|", "/") for cell in cells) + " |"


def _sentence(message: str) -> str:
    """A message without the folders of this machine."""
    words = [Path(word).name if word.startswith("/") else word for word in message.split()]
    return " ".join(words)


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def _wanted(only: list[str] | None) -> list[str]:
    """Robots with few joints first."""
    found = {}
    for name, others in distinct().items():
        if not only or {name, *others} & set(only):
            found[name] = len(survey(load_description(EXAMPLE_PREFIX + name)).joints)
    return sorted(found, key=lambda name: found[name])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", help="these robots")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--resume", action="store_true", help="pass over what is there already")
    parser.add_argument("--table-only", action="store_true")
    parser.add_argument("--no-random", action="store_true", help="leave the random motions out")
    parser.add_argument("--random", type=Path, metavar="CONFIG", help="only random motions")
    parser.add_argument("--folder", type=Path, default=Path("all_robots"), help="of results")
    options = parser.parse_args()
    if options.random is not None:
        print(json.dumps(best_random(options.random)))
        return
    folder = options.folder.resolve()
    results = folder / "records"
    results.mkdir(parents=True, exist_ok=True)

    def plan(name: str) -> None:
        path = results / f"{name}.json"
        if options.resume and path.exists():
            return
        record = examine(name, folder)
        path.write_text(json.dumps(record, indent=1, ensure_ascii=False))
        figure = _figure(record.get("condition_number"))
        outcome = record.get("message", record.get("status", ""))
        print(f"{name}: {figure} {record['seconds']} {outcome}", flush=True)

    def draw(name: str) -> None:
        path = results / f"{name}.json"
        record = json.loads(path.read_text())
        if record.get("admissible") and not {"random", "random_message"} & set(record):
            record = with_random(record, folder)
            path.write_text(json.dumps(record, indent=1, ensure_ascii=False))
            print(f"{name}: random {_figure(record.get('random'))}", flush=True)

    if not options.table_only:
        for stage in (plan,) if options.no_random else (plan, draw):
            with ThreadPoolExecutor(options.workers) as pool:
                list(pool.map(stage, _wanted(options.only)))
    TABLE.write_text(table(results), encoding="utf-8")


if __name__ == "__main__":
    main()
