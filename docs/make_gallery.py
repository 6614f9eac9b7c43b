"""Writes docs/gallery: logs of real robots from the repository, diagnosed, one page for each robot.

Run: python -m docs.make_gallery [--robot tx40 …] [--from FOLDER]

Every figure and every picture comes from the diagnoses of this run. Ten minutes of processor time;
with `--from` diagnoses that FOLDER holds already (`excite diagnose … -o FOLDER/tx40-1.h5`, in the
order of `benchmarks.real_robots`) are drawn, and the others are made there.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
from PIL import Image

from benchmarks.real_robots import DATA, LOGS, Answer, Log, diagnosed, row, table
from docs.gallery_page import HEAD, IN_FULL, OTHERWISE, Diagnosed, page
from excite_cli import Diagnosis, load_case, load_data, read_diagnosis
from excite_cli.diagnosis.next_motion import next_experiment
from excite_cli.report.plot_figure import (
    BLUE,
    FORBIDDEN,
    GREEN,
    GREY,
    HELD_OUT,
    PURPLE,
    VERMILION,
    save_figure,
)
from excite_cli.shown.answer import Command
from excite_cli.summary.diagnosis import diagnosis_data
from excite_cli.summary.figures import diagnosis_figures

TARGET = Path(__file__).parent / "gallery"
ROBOTS = tuple(dict.fromkeys(log.folder for log in LOGS))
_WIDTH = 1170  # px of a picture
LARGEST = 150_000  # bytes of one
_INDEX = f"""{HEAD}

# Gallery of real robots

Logs of six robots, by their authors, each diagnosed from its URDF alone: from the log to the
residual, to names, to the error before and after, and to what stays unexplained. Made by
`make gallery` from the files in `data/`; every number and picture is of the run that made the page.
Errors are relative, on data that the fit never saw, mean over joints, where joints move.

"""


def main() -> None:
    """Diagnose, write the pages and the index."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--robot", nargs="+", choices=ROBOTS, default=ROBOTS)
    parser.add_argument("--from", dest="folder", type=Path, help="where diagnoses are kept")
    arguments = parser.parse_args()
    with TemporaryDirectory() as temporary:
        kept = arguments.folder or Path(temporary)
        kept.mkdir(parents=True, exist_ok=True)
        rows = {robot: written(robot, kept, TARGET) for robot in arguments.robot}
    if arguments.robot == ROBOTS:
        (TARGET / "index.md").write_text(_index(rows), encoding="utf-8")


def written(robot: str, kept: Path, target: Path) -> list[tuple[str, ...]]:
    """Write the page and the pictures of a robot to `target`; rows of the table of real robots."""
    target.mkdir(parents=True, exist_ok=True)
    for old in target.glob(f"{robot}-*.png"):
        old.unlink()
    logs = [log for log in LOGS if log.folder == robot]
    config, number, answers, rows = Path("data", robot, f"{robot}.yaml"), 0, [], []
    for log in logs:
        every = []
        for options in log.runs:
            number += 1
            every.append(_found(log, options, kept / f"{robot}-{number}.h5"))
        told = [Answer(diagnosis_data(each, next_experiment(each))) for each in every]
        rows.append(row(log, told))
        file = config.with_name(log.file)
        command = Command(("excite", "diagnose", str(config), str(file), *log.runs[0]))
        kinds = OTHERWISE if answers else IN_FULL
        pictures = drawn(every[0], kinds, target / f"{robot}-{len(answers) + 1}")
        answers.append(Diagnosed(log.words, command, every[0], rows[-1][-1], pictures))
    case = load_case(DATA.parent / config)
    data = load_data(case, DATA / robot / logs[0].file, tell=lambda note: None)
    text = page(facts(robot), data, answers)
    (target / f"{robot}.md").write_text(text, encoding="utf-8")
    return rows


def drawn(found: Diagnosis, kinds: Sequence[str], target: Path) -> dict[str, str]:
    """Write figures of a diagnosis as small PNGs beside `target`; their names by figure."""
    names = {}
    for figure, draw in diagnosis_figures(found).items():
        if not figure.startswith(tuple(kinds)):
            continue
        path = target.with_name(f"{target.name}-{figure}.png")
        save_figure(draw(), path, "png")
        _shrink(path)
        names[figure] = path.name
    return names


def _shrink(path: Path) -> None:
    """A picture as wide as a page, or less, in few colours and bytes."""
    with Image.open(path) as picture:
        whole, width = picture.convert("RGB"), _WIDTH
    while width == _WIDTH or path.stat().st_size >= LARGEST:
        size = (width, round(whole.height * width / whole.width))
        small = whole.resize(size, Image.Resampling.LANCZOS)
        small.quantize(palette=_palette(), dither=Image.Dither.NONE).save(path, optimize=True)
        width = round(0.9 * width)


def _palette() -> Image.Image:
    """The colours of figures and some steps from each to white: a line keeps its own, if rare."""
    whole, light = (1.0, 0.75, 0.5, 0.3, 0.12), (1.0, 0.5)
    dark = ("#000000", GREY, BLUE, VERMILION, GREEN, PURPLE)
    steps = [
        round(255 + (int(colour[at : at + 2], 16) - 255) * share)
        for colours, shares in ((dark, whole), ((HELD_OUT, FORBIDDEN), light))
        for colour in colours
        for share in shares
        for at in (1, 3, 5)
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette([255, 255, 255, *steps])
    return palette


def _found(log: Log, options: Sequence[str], path: Path) -> Diagnosis:
    if not path.exists():
        diagnosed(log, (*options, "-o", str(path)))
    return read_diagnosis(path)


def facts(robot: str) -> Mapping[str, str]:
    """What the log's authors are told to have recorded."""
    with h5py.File(DATA / robot / f"{robot}.h5") as file:
        return {name: str(value) for name, value in file.attrs.items()}


def _index(rows: Mapping[str, Sequence[tuple[str, ...]]]) -> str:
    linked = [
        (f"[{cells[0]}]({robot}.md)", *cells[1:])
        for robot, every in rows.items()
        for cells in every
    ]
    return _INDEX + table(linked) + "\n"


if __name__ == "__main__":
    main()
