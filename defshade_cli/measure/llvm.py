"""Finds an LLVM that Mitsuba can compile with."""

from __future__ import annotations

import ctypes
import os

from defshade_cli.errors import DefshadeError

_LLVM = (*(f"libLLVM.so.{version}.1" for version in range(22, 17, -1)), "libLLVM-17.so.1")


def find_llvm() -> None:
    """Name the newest LLVM there is to Dr.Jit, whose own search may take one too old for the processor.

    Raises DefshadeError where none loads.
    """
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    for name in _LLVM:
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        os.environ["DRJIT_LIBLLVM_PATH"] = name
        return
    raise DefshadeError(f"Mitsuba needs LLVM 17 or newer: none of {', '.join(_LLVM)} loads")
