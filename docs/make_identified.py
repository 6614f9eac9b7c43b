"""Writes models/ and the table of docs/identified.md: what was identified of real robots.

Run: python -m docs.make_identified [--robot tx40 …]

Diagnoses the first log of every robot of `benchmarks.real_robots`, four minutes of processor time
in all; robots that are left out keep their models. A model is a config with its numbers and an
MJCF; the table is made of these files alone.
"""

import argparse
import re
from collections import Counter
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks import pages
from benchmarks.pages import MarkedPart, percent
from benchmarks.program import excite
from benchmarks.real_robots import DATA, LOGS, Answer, Log, diagnosed
from docs.make_gallery import ROBOTS, facts
from excite_cli import Model, __version__, load_case, load_data

PAGE, MODELS = Path(__file__).parent / "identified.md", DATA.parent / "models"
PART = MarkedPart("identified robots", "docs.make_identified")
FIRST = {robot: next(log for log in LOGS if log.folder == robot) for robot in ROBOTS}
HEADS = ("robot", "URDF", "log", "seconds:", "URDF untouched:", "textbook:", "with effects:",
         "as MJCF:", "effects found", "model")  # fmt: skip
_URDFS = {
    "tx40": "of the log's authors",
    "ur10_cb": "`ur_description` of ROS-Industrial, BSD",
    "kr300": "made from the numbers of the log's authors",
    "tiago": "PAL Robotics, Apache 2.0",
    "med7": "of the log's authors",
    "go2": "`go2` of `example-robot-data`",
}
_ERRORS = ("untouched", "textbook", "after", "as MJCF")
_REPOSITORY = "https://github.com/excite-robotics/excite/blob/main"
_HEAD = re.compile(r"^# ([^:\n]+): (.*)$", re.MULTILINE)


def main() -> None:
    """Diagnose, write the models and the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--robot", nargs="+", choices=ROBOTS, default=ROBOTS)
    for robot in parser.parse_args().robot:
        log, config, mjcf = FIRST[robot], MODELS / f"{robot}.yaml", MODELS / f"{robot}.xml"
        with TemporaryDirectory() as folder:
            kept = f"{folder}/{robot}.h5"
            written = "-o", kept, "--apply", str(config), "--overwrite"
            answer = diagnosed(log, (*log.runs[0], *written))
            export = "export", kept, "--format", "mjcf", "-o", mjcf, "--overwrite", "--json"
            left = excite(*export, "--no-progress").answer["held_out"]["file"]
        words = head(log, answer, left)
        config.write_text(words + config.read_text("utf-8"), encoding="utf-8")
        said = "".join(line for line in words.splitlines(keepends=True) if "--" not in line)
        mjcf.write_text(f"<!--\n{said}-->\n{mjcf.read_text('utf-8')}", encoding="utf-8")
    PART.write(PAGE, table())


def head(log: Log, answer: Answer, as_mjcf: float) -> str:
    """Comments that say where a model is from, which `head_of` reads."""
    robot, said = log.folder, facts(log.folder)
    config, file = f"data/{robot}/{robot}.yaml", f"data/{robot}/{log.file}"
    runs = load_data(load_case(DATA / robot / f"{robot}.yaml"), DATA / robot / log.file).runs
    errors = [*map(answer.error, _ERRORS[:3]), as_mjcf]
    words = {
        "robot": said["robot"],
        "urdf": _URDFS[robot],
        "log": f"{file}, {sum(run.duration for run in runs):.0f} s",
        "source of the log": said["source"],
        "licence of the log": said["licence"],
        "made by": f"excite {__version__}, {date.today()}",
        "command": " ".join(("excite diagnose", config, file, *log.runs[0])),
        **{f"held-out error, {when}": f"{x:.6f}" for when, x in zip(_ERRORS, errors, strict=True)},
    }
    return "".join(f"# {name}: {value}\n" for name, value in words.items())


def head_of(robot: str) -> dict[str, str]:
    """What the comments of a model say."""
    return dict(_HEAD.findall((MODELS / f"{robot}.yaml").read_text(encoding="utf-8")))


def table() -> str:
    """A row for each model."""
    return pages.table(HEADS, [row(robot) for robot in ROBOTS])


def row(robot: str) -> tuple[str, ...]:
    """Cells of a model."""
    said = head_of(robot)
    (name,) = re.findall(r"github\.com/([\w-]+/[\w-]+)", said["source of the log"])
    licence = re.split(r" by |,? \(", said["licence of the log"])[0]
    kinds = Counter(each.kind for each in Model.load(MODELS / f"{robot}.yaml").effects)
    return (
        f"[{said['robot'].split(' (')[0]}](gallery/{robot}.md)",
        said["urdf"],
        f"[{name}](https://github.com/{name}), {licence}",
        said["log"].split(", ")[1].removesuffix(" s"),
        *(percent(float(said[f"held-out error, {when}"])) for when in _ERRORS),
        ", ".join(
            f"{n} × {kind.replace('_', ' ')}".removeprefix("1 × ")
            for kind, n in kinds.most_common()
        ),
        ", ".join(f"[{form}]({_REPOSITORY}/models/{robot}.{form})" for form in ("yaml", "xml")),
    )


if __name__ == "__main__":
    main()
