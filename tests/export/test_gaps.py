"""Templates with gaps: what is put into one is never taken for another."""

from excite_cli.export.c_model import filled


def test_what_is_put_in_is_not_filled_again() -> None:
    gaps = {"ROBOT": "the @N@ of @ROBOT@", "N": "@M@", "M": r"\1 \g<0>"}
    assert filled("@ROBOT@, @N@, @M@ @X@ @", gaps) == r"the @N@ of @ROBOT@, @M@, \1 \g<0> @X@ @"
