"""The setup of a controller: values of JSON that cannot be changed, because all robots of a process have the same."""

from __future__ import annotations

from typing import Any, NoReturn


def _refuse(*_: Any, **__: Any) -> NoReturn:
    raise TypeError("self.setup is read-only, because all robots have the same; copy.deepcopy(…) of a part can be changed")


class ReadOnlyDict(dict[str, Any]):
    """Part of the setup. `copy.deepcopy` returns an ordinary dict."""

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce_ex__(self, _: Any) -> Any:
        return dict, (dict(self),)


class ReadOnlyList(list[Any]):
    """Part of the setup. `copy.deepcopy` returns an ordinary list."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = append = clear = extend = insert = pop = remove = reverse = sort = _refuse

    def __reduce_ex__(self, _: Any) -> Any:
        return list, (list(self),)


def read_only(value: Any) -> Any:
    """Returns a value of JSON whose dicts and lists cannot be changed."""
    if isinstance(value, dict):
        return ReadOnlyDict({key: read_only(below) for key, below in value.items()})
    if isinstance(value, list):
        return ReadOnlyList(map(read_only, value))
    return value
