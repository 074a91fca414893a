"""Equal values made one object, so that what follows from them can be kept by identity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np

T = TypeVar("T")


def shared(new: T, old: T | None) -> T:
    """`new`, with the parts of `old` wherever they are equal; `old` itself where all of it is.

    Looks into dataclasses, mappings and tuples down to arrays, which are equal when their bytes are.
    """
    if old is None or new is old or type(new) is not type(old):
        return new
    if isinstance(new, np.ndarray):
        return old if _are_equal(new, cast(np.ndarray, old)) else new
    if is_dataclass(new) and not isinstance(new, type):
        return cast(T, _shared_fields(new, old))
    if isinstance(new, Mapping):
        parts = {name: shared(part, cast(Mapping[str, Any], old).get(name)) for name, part in new.items()}
        return old if _are_one(parts, cast(dict[str, Any], old)) else cast(T, parts)
    return old if new == old else new


def _shared_fields(new: object, old: object) -> object:
    names = [field.name for field in fields(new)]  # type: ignore[arg-type]
    parts = {name: shared(getattr(new, name), getattr(old, name)) for name in names}
    if _are_one(parts, {name: getattr(old, name) for name in names}):
        return old
    return replace(new, **parts)  # type: ignore[type-var]


def _are_one(new: Mapping[str, object], old: Mapping[str, object]) -> bool:
    return new.keys() == old.keys() and all(part is old[name] for name, part in new.items())


def _are_equal(new: np.ndarray, old: np.ndarray) -> bool:
    """Compared by bytes, by which NaN equals itself."""
    if new.dtype != old.dtype or new.shape != old.shape:
        return False
    return np.array_equal(np.ascontiguousarray(new).view(np.uint8), np.ascontiguousarray(old).view(np.uint8))
