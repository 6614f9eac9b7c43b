"""What a console and a notebook show of data, simulations, fits and diagnoses."""

from html import escape

from excite_cli import load_data, read_fit, read_result, simulate
from excite_cli.shown.answer import Command, Shown, Table
from excite_cli.summary.diagnosis import diagnosis_answer
from excite_cli.summary.simulation import simulation_answer
from tests.api.conftest import Loop
from tests.diagnosis.synthetic_diagnosis import make_diagnosis


def html_of(record: Shown) -> str:
    html = record._repr_html_()
    assert html is not None
    return html


def test_measured_data(loop: Loop) -> None:
    data = load_data(loop.problem, loop.data)
    assert repr(data) == "Dataset(2 joints; 2 runs, 12 s)"
    assert "Runs of elbow, slide" in html_of(data)
    assert all(f">{run.name}</td>" in html_of(data) for run in data.runs)


def test_a_simulation(loop: Loop) -> None:
    effects = ["coulomb_friction@elbow=2", "coulomb_friction@slide=3"]
    found = simulate(loop.problem, read_result(loop.result), effects, chosen=[1], declared=False)
    assert repr(found) == "Simulation(motion_1; coulomb_friction@elbow, coulomb_friction@slide)"
    runs, table = simulation_answer(found, "data.h5", 1).parts[:2]
    assert isinstance(runs, Table)
    assert isinstance(table, Table)
    turns, slides = (row[2] for row in table.rows)
    assert turns.startswith("coulomb 2 N·m")
    assert slides.startswith("coulomb 3 N")
    assert "N·m" not in slides
    (run,) = (dict(zip(runs.columns, row, strict=True)) for row in runs.rows)
    elbow, slide = 1e3 * found.tracking["motion_1"]
    assert run["RMS over joints [mrad]"] == f"{elbow:.3f}"
    assert run["RMS over joints [mm]"] == f"{slide:.3f}"
    assert run["worst joint's RMS"] == (f"{elbow:.3f} mrad" if elbow > slide else f"{slide:.3f} mm")
    assert all(escape(cell) in html_of(found) for cell in table.rows[0])


def test_a_fit_that_was_read(loop: Loop) -> None:
    stored = read_fit(loop.fit)
    fit = stored.fit
    assert repr(fit).startswith(f"Fit({len(fit.names)} parameters (")
    assert "of 2 joints" in repr(stored)
    assert f"mean relative error {stored.error.mean_relative:.2%} on" in repr(stored)
    assert all(escape(name) in html_of(fit) for name in fit.names)
    assert "Error of the torque on held-out data" in html_of(stored)
    assert ">N</td>" in html_of(stored)  # the slide


def test_a_diagnosis_is_told_as_by_the_program() -> None:
    found = make_diagnosis(rivals=())
    assert "viscous friction on " in repr(found)
    assert "mean error" in repr(found)
    answer = diagnosis_answer(found, "arm.yaml", {"diagnosis": "d.h5", "config": None})
    for part in answer.parts[:-5]:  # but for what the program says of itself
        assert escape(part if isinstance(part, str) else part.title) in html_of(found)
    assert answer.parts[-1] == Command(("excite", "optimize", "arm.yaml", "--after", "d.h5"))
    assert answer.data["output"] == {"diagnosis": "d.h5"}
