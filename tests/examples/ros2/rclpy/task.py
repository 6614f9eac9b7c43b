from typing import Any


class Future:
    def __init__(self, value: Any = None, done: bool = False) -> None:
        self._value, self._done = value, done

    def set_result(self, value: Any) -> None:
        self._value, self._done = value, True

    def done(self) -> bool:
        return self._done

    def result(self) -> Any:
        return self._value
