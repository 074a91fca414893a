"""GLSL files to programs.

`#include "path"` is resolved once a program, relative to the shaders' folder; sources that Python generates are
included by name in the same way. Every line keeps its origin, so a compile error reads as file:line.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import moderngl

from defshade_cli.errors import ShaderError
from defshade_cli.resources import SHADERS

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_LOCATION = re.compile(r"\b(\d+)(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:")  # Mesa "0:12(3):", NVIDIA "0(12) :"
_STAGES = {"vert": "vertex_shader", "frag": "fragment_shader", "geom": "geometry_shader"}


@dataclass(frozen=True, slots=True)
class Source:
    """One shader after its includes: the text, and the file that each `#line` number of a source stands for."""

    text: str
    files: tuple[str, ...]

    def locate(self, message: str) -> str:
        """The driver's message with its source numbers replaced by file names."""

        def named(match: re.Match[str]) -> str:
            index, line = int(match[1]), match[2] or match[3]
            return f"{self.files[index]}:{line}:" if index < len(self.files) else match[0]

        return _LOCATION.sub(named, message)


@dataclass(slots=True)
class _Assembly:
    generated: Mapping[str, str]
    files: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def include(self, name: str) -> None:
        if name in self.files:
            return
        self.files.append(name)
        index = len(self.files) - 1
        self.lines.append(f"#line 1 {index}")
        for number, line in enumerate(self._read(name).splitlines(), 1):
            if match := _INCLUDE.match(line):
                self.include(match[1])
                self.lines.append(f"#line {number + 1} {index}")
            else:
                self.lines.append(line)

    def _read(self, name: str) -> str:
        if name in self.generated:
            return self.generated[name]
        try:
            return (SHADERS / name).read_text(encoding="utf-8")
        except OSError as error:
            raise ShaderError(f"{name}: no such shader in {SHADERS.name}/") from error


def assemble(name: str, defines: Iterable[str] = (), generated: Mapping[str, str] | None = None) -> Source:
    """The file `name` with its includes and `#define`s; a define is "NAME" or "NAME value"."""
    assembly = _Assembly(generated or {})
    assembly.include(name)
    header = ["#version 450 core", *(f"#define {define}" for define in defines)]
    return Source("\n".join([*header, *assembly.lines, ""]), tuple(assembly.files))


class ShaderLibrary:
    """Compiles each program once and keeps it."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._compute: dict[tuple[str, ...], moderngl.ComputeShader] = {}

    def program(self, *files: str, defines: Iterable[str] = (), generated: Mapping[str, str] | None = None) -> moderngl.Program:
        """A program of one file a stage; the suffix (.vert, .frag) names the stage. Raises ShaderError."""
        sources = [assemble(name, defines, generated) for name in files]
        key = tuple(source.text for source in sources)
        if key not in self._programs:
            stages = {_STAGES[name.rpartition(".")[2]]: source.text for name, source in zip(files, sources, strict=True)}
            try:
                self._programs[key] = self._context.program(**stages)
            except moderngl.Error as error:
                raise ShaderError(_readable(str(error), sources)) from error
        return self._programs[key]

    def compute(self, name: str, defines: Iterable[str] = (), generated: Mapping[str, str] | None = None) -> moderngl.ComputeShader:
        """A compute program. Raises ShaderError."""
        source = assemble(name, defines, generated)
        if (source.text,) not in self._compute:
            try:
                self._compute[source.text,] = self._context.compute_shader(source.text)
            except moderngl.Error as error:
                raise ShaderError(_readable(str(error), [source])) from error
        return self._compute[source.text,]


def _readable(message: str, sources: list[Source]) -> str:
    """moderngl names the stage of a failing shader in its message; that stage's source names the lines."""
    stage = next((s for s in sources if s.files[0].rpartition(".")[2] in message.lower()[:200]), sources[-1])
    lines = [line for line in stage.locate(message).splitlines() if "error" in line.lower()]
    return f"{stage.files[0]}: " + "; ".join(lines or [message])
