"""The small problem and its result, as tests of the report have them."""

from tests.report.conftest import case as case
