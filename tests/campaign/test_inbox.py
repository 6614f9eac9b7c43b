"""Files that people carry: a motion is laid out, a log that is whole is taken."""

import time
from pathlib import Path
from threading import Thread

from excite_cli.campaign.inbox import Inbox
from excite_cli.campaign.measure import Take


def test_a_log_is_taken_once_it_grows_no_more(tmp_path: Path) -> None:
    motion = tmp_path / "motion.csv"
    motion.write_text("t\n0\n")
    box, said = tmp_path / "inbox", []
    take = Take("round_1_motion_1", motion, tmp_path / "log.h5", 12.0, tmp_path / "x.txt")

    def person() -> None:
        while not (box / "round_1_motion_1.csv").exists():
            time.sleep(0.05)
        for part in range(3):
            with (box / "round_1_motion_1_log.h5").open("a") as file:
                file.write(f"part {part}\n")
            time.sleep(1.0)

    carrier = Thread(target=person)
    carrier.start()
    Inbox(box, said.append, ".h5").take(take)
    carrier.join()
    assert take.data.read_text() == "part 0\npart 1\npart 2\n"
    assert (box / "round_1_motion_1.csv").read_text() == "t\n0\n"
    assert said == [
        f"play {box / 'round_1_motion_1.csv'} (12 s) and put its log there as "
        "round_1_motion_1_log.h5"
    ]
    assert not (box / "round_1_motion_1_log.h5").exists()  # the next one is another take
    assert (box / "round_1_motion_1_log.read.h5").exists()
