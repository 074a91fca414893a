"""Our dataclass makes the classes that the standard library's makes."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import weakref
from collections.abc import Callable
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli.dataclass import dataclass

MAKERS = {"ours": dataclass, "theirs": dataclasses.dataclass}

OPTIONS = st.fixed_dictionaries(
    {"frozen": st.booleans(), "eq": st.booleans(), "slots": st.booleans(), "kw_only": st.booleans()}
)
FIELDS = st.lists(
    st.tuples(
        st.sampled_from(["needed", "default", "made"]),
        st.fixed_dictionaries({}, optional={"compare": st.booleans(), "repr": st.booleans(), "hash": st.booleans()}),
    ),
    min_size=1,
    max_size=4,
)
VALUES = st.lists(st.one_of(st.integers(0, 2), st.just(float("nan")), st.text(max_size=2)), min_size=8, max_size=8)


def both(options: dict[str, bool], rows: list[tuple[str, dict[str, bool]]]) -> list[type]:
    """The same class by both makers."""
    rows = sorted(rows, key=lambda row: row[0] != "needed")
    kinds: dict[str, dict[str, Any]] = {"needed": {}, "default": {"default": 7}, "made": {"default_factory": list}}
    made = []
    for maker in MAKERS.values():
        names = {f"field{i}": dataclasses.field(**kinds[kind], **more) for i, (kind, more) in enumerate(rows)}
        space = {"__annotations__": dict.fromkeys(names, "object"), "__doc__": "A class.", "kind": "a", **names}
        made.append(maker(**options)(type("Made", (), space)))
    return made


def outcome(function: Callable[[], Any]) -> Any:
    """What comes of a call: its value, or the error."""
    try:
        return function()
    except (TypeError, AttributeError, KeyError) as error:
        return type(error)


def described(cls: type, values: list[Any]) -> list[Any]:
    """All that can be seen of two instances."""
    names = [field.name for field in dataclasses.fields(cls)]
    first, second = dict(zip(names, values, strict=False)), dict(zip(names, values[4:], strict=False))
    one, other = cls(**first), cls(**second)
    name = names[0]
    return [
        outcome(lambda: cls(*values[: len(names)]) == one),
        outcome(lambda: repr(cls())),
        repr(one),
        [getattr(one, name) for name in names],
        one == other,
        one == cls(**first),
        one == 3,
        outcome(lambda: hash(one) == hash(cls(**first))),
        outcome(lambda: setattr(one, name, 1)),
        outcome(lambda: delattr(other, name)),
        outcome(lambda: repr(dataclasses.replace(one, **second))),
        outcome(lambda: repr(copy.copy(one))),
        outcome(lambda: dataclasses.asdict(one)),
        outcome(lambda: cls(unknown=1)),
        [getattr(cls, "__match_args__", None), getattr(cls, "__slots__", None), cls.__doc__, cls.__hash__ is None],
        hasattr(one, "__dict__"),
    ]


@given(OPTIONS, FIELDS, VALUES)
def test_classes_behave_as_the_standard_librarys(
    options: dict[str, bool], rows: list[tuple[str, dict[str, bool]]], values: list[Any]
) -> None:
    ours, theirs = (described(cls, values) for cls in both(options, rows))
    assert str(ours) == str(theirs)


@dataclass(frozen=True, slots=True)
class Point:
    x: float
    y: float = 0.0
    dimensions: ClassVar[int] = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", float(self.x))


@dataclass(frozen=True, slots=True, kw_only=True)
class Named(Point):
    name: str
    tags: list[str] = dataclasses.field(default_factory=list)


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class Kept:
    values: Any


@dataclass(frozen=True)
class Measured:
    values: Any

    @cached_property
    def total(self) -> float:
        return float(np.sum(self.values))


def test_fields_are_inherited_and_not_shared() -> None:
    named, other = Named(1, name="a"), Named(1, 2, name="b", tags=["t"])
    assert repr(named) == "Named(x=1.0, y=0.0, name='a', tags=[])"
    assert (other.x, other.y, other.name, other.tags) == (1.0, 2, "b", ["t"])
    assert named.tags is not Named(1, name="a").tags
    assert named != Point(1) and isinstance(named, Point)


def test_what_is_pickled_comes_back() -> None:
    assert pickle.loads(pickle.dumps(Named(1, name="a"))) == Named(1, name="a")
    assert pickle.loads(pickle.dumps(Measured([1, 2]))).total == 3


def test_arrays_equal_themselves() -> None:
    array = np.arange(3)
    assert Measured(array) == Measured(array)
    assert Measured(array).total == 3


def test_what_is_kept_weakly_goes() -> None:
    kept = Kept(1)
    known = weakref.ref(kept)
    assert known() is kept and kept != Kept(1) and len({kept, Kept(1)}) == 2
    del kept
    assert known() is None


def test_frozen_says_which_field() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'x'"):
        Point(1).x = 2  # type: ignore[misc]
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'x'"):
        del Point(1).x  # type: ignore[misc]


def test_an_object_that_holds_itself_is_told() -> None:
    kept = Kept([])
    kept.values.append(kept)
    assert repr(kept) == "Kept(values=[...])"
