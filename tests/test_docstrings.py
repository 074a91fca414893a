"""Whatever has a public name says what it is: arrays with their shapes, functions that raise with what they raise."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import defshade_cli
from defshade_cli import errors

ARRAYS = re.compile(r"NDArray|Pixels|Matrix|Vector")
SHAPE = re.compile(r"\([^()]*(\b[A-Z]\b|\b\d\b|\.\.\.|…|height, width)[^()]*\)")
"""As (N, 3), (H, W, C), (..., 3), (height, width)."""

ERRORS = {
    n: kind for n, kind in vars(errors).items() if inspect.isclass(kind) and issubclass(kind, errors.DefshadeError)
}
ANY_ERROR = "errors of errors.py"
NEVER = ("default_window", "reference_noise")
"""Give others what these cannot fail at: a camera as it is made, arrays of one size."""

MODULES = [info.name for info in pkgutil.walk_packages(defshade_cli.__path__, "defshade_cli.") if "._" not in info.name]


@dataclass(frozen=True)
class Public:
    """A function or method: what it is called, its docstring and those around it, which speak for it."""

    name: str
    function: Callable[..., Any]
    docstring: str | None
    around: str


def _module(name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        pytest.skip(f"an extra is not installed: {error}")


def _own(module: ModuleType) -> Iterator[tuple[str, Any]]:
    for name, value in vars(module).items():
        if not name.startswith("_") and getattr(value, "__module__", None) == module.__name__:
            yield name, value


def _functions(module: ModuleType) -> Iterator[Public]:
    said = module.__doc__ or ""
    for name, value in _own(module):
        if inspect.isclass(value):
            yield from _methods(value, said)
        elif inspect.isfunction(plain := inspect.unwrap(value)):
            yield Public(name, plain, inspect.getdoc(value), said)


def _methods(owner: type, said: str) -> Iterator[Public]:
    for name, value in vars(owner).items():
        plain = getattr(value, "fget", None) or getattr(value, "__func__", None) or getattr(value, "func", value)
        if not name.startswith("_") and inspect.isfunction(plain):
            inherited = (inspect.getdoc(getattr(base, name, None)) for base in owner.__mro__[1:] if hasattr(base, name))
            docstring = inspect.getdoc(value) or next(inherited, None)
            yield Public(f"{owner.__name__}.{name}", plain, docstring, f"{said} {inspect.getdoc(owner)}")


@pytest.mark.parametrize("name", MODULES)
def test_public_names_have_docstrings(name: str) -> None:
    module = _module(name)
    lacking = [public.name for public in _functions(module) if not public.docstring]
    lacking += [name for name, value in _own(module) if inspect.isclass(value) and not inspect.getdoc(value)]
    assert not lacking, f"{name}: {', '.join(lacking)}"
    assert module.__doc__ or not Path(str(module.__file__)).stat().st_size, f"{name} has no docstring"


@pytest.mark.parametrize("name", MODULES)
def test_arrays_have_shapes(name: str) -> None:
    """In the function's own docstring, its class's or its module's."""
    takes_arrays = (f for f in _functions(_module(name)) if ARRAYS.search(str(f.function.__annotations__)))
    lacking = [public.name for public in takes_arrays if not SHAPE.search(f"{public.docstring} {public.around}")]
    assert not lacking, f"{name}: {', '.join(lacking)}"


@pytest.mark.parametrize("name", MODULES)
def test_errors_are_named(name: str) -> None:
    """Those of errors.py that a function raises, itself or by a private one, or lets through of what it calls.

    By their own name or that of a kind above them.
    """
    module = _module(name)
    lacking = {
        public.name: missing
        for public in _functions(module)
        if public.name not in NEVER and (missing := _unnamed(public, module))
    }
    assert not lacking, f"{name}: {lacking}"


def _unnamed(public: Public, module: ModuleType) -> set[str]:
    said = f"{public.docstring} {public.around}"
    if ANY_ERROR in said:
        return set()
    named = tuple(kind for name, kind in ERRORS.items() if re.search(rf"\b{name}\b", said))
    return {name for name in _raised(public.function, module, frozenset()) if not issubclass(ERRORS[name], named)}


def _raised(function: Callable[..., Any], module: ModuleType, seen: frozenset[str]) -> set[str]:
    """Names of errors; what a function tries may be caught, so that only its own raises count."""
    source = inspect.getsource(function)
    tree = list(ast.walk(ast.parse(f"if True:\n{source}" if source.startswith(" ") else source)))
    calls = (node.exc.func for node in tree if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call))
    own = ERRORS.keys() & {call.id for call in calls if isinstance(call, ast.Name)}
    if any(isinstance(node, ast.Try) for node in tree):
        return own
    called = {node.func.id for node in tree if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)} - seen
    found = ((name, inspect.unwrap(f)) for name in called if inspect.isfunction(f := vars(module).get(name)))
    passed = (
        _raised(f, module, seen | called) if name.startswith("_") else _said_to_raise(f)
        for name, f in found
        if f.__module__.startswith("defshade_cli.")
    )
    return own.union(*passed)


def _said_to_raise(function: Callable[..., Any]) -> set[str]:
    said = (inspect.getdoc(function) or "").partition("aises ")[2]
    return {name for name in ERRORS if re.search(rf"\b{name}\b", said)}
