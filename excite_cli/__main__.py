"""`python -m excite_cli`, for environments whose scripts are not on the path."""

from excite_cli.cli.app import main

main()
