"""What a test of the report is given: a small problem and its result."""

from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result

Case = tuple[Problem, Result]
