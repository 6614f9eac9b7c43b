"""Third-party robots in four formats, by the commands of a user, without an edit.

Per robot: `excite init`, `optimize`, `check`, `simulate` with an effect that the config does not
declare, and `diagnose`. What came of it is kept as one JSON file per robot, so that a run can be
interrupted and gone on with; the figures of docs/robots.md are made of all that are there.

Run: python -m benchmarks.all_robots --sources FOLDER [--only WORD …] [--workers 2] [--resume]
     python -m benchmarks.all_robots --sources FOLDER --page-only
where FOLDER is for the packages' files (2.3 GB): where it is not there, pip fills it. No code of
these packages is run. Without --sources: the robots of example-robot-data alone.
"""

import argparse
import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.program import ROOT
from benchmarks.robots.journey import travelled
from benchmarks.robots.page import PART, page
from benchmarks.robots.sources import Source, fetch, sources

PAGE = ROOT / "docs" / "robots.md"
SEED = 31415


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sources", type=Path, help="folder of the packages' files")
    parser.add_argument("--only", nargs="+", help="robots whose name has one of these words")
    parser.add_argument("--seed", type=int, default=SEED, help="of what is planted")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--resume", action="store_true", help="pass over what is there already")
    parser.add_argument("--page-only", action="store_true")
    parser.add_argument("--folder", type=Path, default=Path("all_robots"), help="of results")
    options = parser.parse_args()
    if options.sources is not None and not options.sources.exists():
        fetch(options.sources)
    known = sources(options.sources and options.sources.resolve())
    records = options.folder.resolve() / "records"
    records.mkdir(parents=True, exist_ok=True)

    def travel(source: Source) -> None:
        path = records / f"{_file(source)}.json"
        if options.resume and path.exists():
            return
        record = travelled(source, records.parent / _file(source), options.seed)
        path.write_text(json.dumps(record, indent=1, ensure_ascii=False))
        found = record.get("diagnosis", {})
        outcome = record.get("message") or f"{record['planted']['kind']}: {found['verdicts']}"
        print(f"{source.name}: {record['seconds']} {outcome}", flush=True)

    if not options.page_only:
        only = options.only
        wanted = [each for each in known if not only or any(word in each.name for word in only)]
        with ThreadPoolExecutor(options.workers) as pool:
            list(pool.map(travel, wanted))
    paths = [(each, records / f"{_file(each)}.json") for each in known]
    there = [(each, json.loads(path.read_text())) for each, path in paths if path.exists()]
    PART.write(PAGE, page(there, known, options.seed))


def _file(source: Source) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", source.name).strip("_")


if __name__ == "__main__":
    main()
