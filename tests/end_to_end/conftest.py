from tests.cli.conftest import cache, excite

__all__ = ["cache", "excite"]
