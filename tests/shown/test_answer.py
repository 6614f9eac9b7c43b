"""Blocks of documents: tables by their rows, and what an answer has of sections."""

import pytest

from excite_cli.shown.answer import Charts, Choice, Command, Fold, Section, Table, Text, parts_of


def test_a_table_has_the_columns_of_its_rows_and_empty_cells_for_others() -> None:
    rows = [{"joint": "a", "error": "1%"}, {"joint": "mean", "why": "so"}]
    table = Table.of("Errors", rows, left=("joint", "unit"), words=("why", "where"))
    assert table.columns == ("joint", "error", "why")
    assert table.rows == (("a", "1%", ""), ("mean", "", "so"))
    assert (table.left, table.words) == (("joint",), ("why",))
    assert [table.is_left(name) for name in table.columns] == [True, False, True]
    assert Table.of("Nothing", [], left=("joint",)).columns == ()


def test_a_table_refuses_rows_and_names_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match="does not have 2 cells"):
        Table("t", ("a", "b"), (("1",),))
    with pytest.raises(ValueError, match="no columns"):
        Table("t", ("a",), (), left=("b",))


def test_an_answer_has_all_blocks_of_sections_but_charts() -> None:
    table, command = Table.of("t", [{"a": "1"}], note="of a"), Command(("excite", "score"))
    blocks = (
        "plain",
        Text("bad", "bad"),
        Charts(("a drawing",)),
        Fold("more", (table,)),
        Choice("motion", (("1", ("first",)), ("2", (command,)))),
    )
    bare, *others = parts_of([Section("a", "A", blocks, "lead"), Section("b", "B", ("end",))])[2:]
    assert parts_of([Section("a", "A", blocks[:2])]) == ["plain", "bad"]
    assert isinstance(bare, Table)
    assert (bare.rows, bare.note) == (table.rows, "")
    assert others == ["of a", "first", command, "end"]
