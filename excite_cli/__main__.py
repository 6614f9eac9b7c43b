"""`python -m excite_cli`, for environments whose scripts are not on the path."""

from excite_cli.cli.app import main

if __name__ == "__main__":
    main()
