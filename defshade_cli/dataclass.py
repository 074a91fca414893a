"""`dataclasses.dataclass`, made cheaply: the start of a render makes a hundred of them.

The standard library writes and compiles code for each method of each class, half a millisecond in all. Here that is
`__init__` alone, and the other methods go by the fields. Classes behave alike, which `tests/test_dataclass.py` holds.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from dataclasses import MISSING, FrozenInstanceError, fields
from operator import attrgetter
from reprlib import recursive_repr
from types import MemberDescriptorType
from typing import TYPE_CHECKING, Any, NoReturn


def _dataclass(*, frozen: bool = False, eq: bool = True, **layout: bool) -> Callable[[type], type]:
    """layout: slots, weakref_slot, kw_only."""

    def decorate(cls: type) -> type:
        cls.__doc__ = cls.__doc__ or cls.__name__  # else its signature would be looked up
        made: type = dataclasses.dataclass(cls, init=False, repr=False, eq=False, **layout)
        methods: dict[str, Any] = {"__init__": _init(made, frozen), "__repr__": _repr}
        if eq:
            methods["__eq__"] = _eq(field.name for field in fields(made) if field.compare)
            hashed = (field.name for field in fields(made) if (field.compare if field.hash is None else field.hash))
            methods["__hash__"] = _hash(hashed) if frozen else None
        if frozen:
            methods |= {"__setattr__": _refuse_to_set, "__delattr__": _refuse_to_delete}
        if frozen and layout.get("slots"):
            methods |= {"__getstate__": _state, "__setstate__": _restore}
        for name, method in methods.items():
            if vars(cls).get(name) is None:
                setattr(made, name, method)
        return made

    return decorate


def _init(cls: type, frozen: bool) -> Callable[..., None]:
    """The one method that is written out, for it is called most."""
    known: dict[str, Any] = {"__name__": cls.__module__, "_absent": MISSING}
    heads: dict[bool, list[str]] = {False: ["self"], True: []}
    body = ["_held = self.__dict__"] if frozen and cls.__dictoffset__ else []
    for field in fields(cls):
        head = value = name = field.name
        if field.default_factory is not MISSING:
            known[f"_make_{name}"] = field.default_factory
            head, value = f"{name}=_absent", f"_make_{name}() if {name} is _absent else {name}"
        elif field.default is not MISSING:
            known[f"_default_{name}"] = field.default
            head = f"{name}=_default_{name}"
        heads[field.kw_only is True].append(head)
        body.append(_setting(cls, name, value, known) if frozen else f"self.{name} = {value}")
    body += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    named = ["*", *heads[True]] if heads[True] else []
    exec(f"def __init__({', '.join(heads[False] + named)}):\n " + "\n ".join(body or ["pass"]), known)
    return known["__init__"]


def _setting(cls: type, name: str, value: str, known: dict[str, Any]) -> str:
    """How a field of a frozen class is set, past its own refusal, in a third of the time of `object.__setattr__`."""
    slot = getattr(cls, name, None)
    if isinstance(slot, MemberDescriptorType):
        known[f"_set_{name}"] = slot.__set__
        return f"_set_{name}(self, {value})"
    return f"_held[{name!r}] = {value}"


def _values(names: Iterable[str]) -> Callable[[Any], tuple[Any, ...]]:
    """A tuple of an object's attributes, also of one: in tuples what is identical is equal, arrays too."""
    first, *others = [*names] or ["__class__"]
    return attrgetter(first, first, *others)


def _eq(names: Iterable[str]) -> Callable[[Any, Any], bool]:
    values = _values(names)
    return lambda self, other: values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented


def _hash(names: Iterable[str]) -> Callable[[Any], int]:
    values = _values(names)
    return lambda self: hash(values(self))


@recursive_repr()
def _repr(self: Any) -> str:
    told = (f"{field.name}={getattr(self, field.name)!r}" for field in fields(self) if field.repr)
    return f"{self.__class__.__qualname__}({', '.join(told)})"


def _refuse_to_set(self: Any, name: str, value: object) -> NoReturn:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: Any, name: str) -> NoReturn:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, field.name) for field in fields(self)]


def _restore(self: Any, state: list[Any]) -> None:
    for field, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass = _dataclass
