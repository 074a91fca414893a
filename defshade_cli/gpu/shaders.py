"""GLSL files to programs.

`#include "path"` is resolved once a program, relative to the shaders' folder; sources that Python generates are
included by name in the same way. Every assembled line keeps its origin, so a compile error reads as file:line
(drivers lose the source number of `#line`, so none is written).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cache
from typing import Any

import moderngl

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import ShaderError
from defshade_cli.resources import SHADERS

_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"]+)"[ \t]*\n', re.MULTILINE)
_LOCATION = re.compile(r"\b\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:")  # Mesa "0:12(3):", NVIDIA "0(12) :"
_STAGES = {"vert": "vertex_shader", "frag": "fragment_shader"}

Texture = moderngl.Texture | moderngl.TextureArray | moderngl.Texture3D

Generated = Mapping[str, str] | None


@dataclass(frozen=True, slots=True)
class Source:
    """One shader after its includes: the text, and the runs of lines it is made of, as (file, first line, lines)."""

    text: str
    origins: tuple[tuple[str, int, int], ...]

    @property
    def name(self) -> str:
        """The file that holds `main`."""
        return self.origins[-1][0]

    def locate(self, message: str) -> str:
        """The driver's message with its line numbers replaced by file:line."""

        def named(match: re.Match[str]) -> str:
            line = int(match[1] or match[2])
            for file, first, count in self.origins:
                if line <= count:
                    return f"{file}:{first + line - 1}:"
                line -= count
            return match[0]

        return _LOCATION.sub(named, message)


@dataclass(slots=True)
class _Assembly:
    generated: Mapping[str, str]
    included: set[str] = field(default_factory=set)
    runs: list[str] = field(default_factory=list)
    origins: list[tuple[str, int, int]] = field(default_factory=list)

    def add(self, run: str, file: str, first: int) -> None:
        """Whole lines of a file."""
        if run:
            self.runs.append(run)
            self.origins.append((file, first, run.count("\n")))

    def include(self, file: str) -> None:
        if file in self.included:
            return
        self.included.add(file)
        runs, included = _parts(self._read(file))
        self.add(runs[0], file, 1)
        number = 1 + runs[0].count("\n")
        for name, run in zip(included, runs[1:], strict=True):
            self.include(name)
            self.add(run, file, number + 1)
            number += 1 + run.count("\n")

    def _read(self, file: str) -> str:
        """All of its lines end."""
        if file in self.generated:
            text = self.generated[file]
            return text if not text or text.endswith("\n") else f"{text}\n"
        return _text_of(file)


@cache
def _parts(text: str) -> tuple[list[str], list[str]]:
    """Runs of lines, and the files included between them."""
    parts = _INCLUDE.split(text)
    return parts[::2], parts[1::2]


@cache
def _text_of(file: str) -> str:
    try:
        return (SHADERS / file).read_text(encoding="utf-8")
    except OSError as error:
        raise ShaderError(f"{file}: no such shader in {SHADERS.name}/") from error


def assemble(name: str, defines: Iterable[str] = (), generated: Generated = None) -> Source:
    """The file `name` with its includes and `#define`s; a define is "NAME" or "NAME value". Raises ShaderError."""
    assembly = _Assembly(generated or {})
    assembly.add("".join(["#version 450 core\n", *(f"#define {define}\n" for define in defines)]), "<header>", 1)
    assembly.include(name)
    return Source("".join(assembly.runs), tuple(assembly.origins))


class ShaderLibrary:
    """Compiles each program once and keeps it."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._compute: dict[tuple[str, ...], moderngl.ComputeShader] = {}

    def program(self, *files: str, defines: Iterable[str] = (), generated: Generated = None) -> moderngl.Program:
        """A program of one file a stage; the suffix (.vert, .frag) names the stage. Raises ShaderError."""
        sources = [assemble(name, defines, generated) for name in files]
        key = tuple(source.text for source in sources)
        if key not in self._programs:
            stages: dict[str, Any] = {_STAGES[source.name.rpartition(".")[2]]: source.text for source in sources}
            try:
                self._programs[key] = self._context.program(**stages)
            except moderngl.Error as error:
                raise ShaderError(_readable(str(error), sources)) from error
        return self._programs[key]

    def compute(self, name: str, defines: Iterable[str] = (), generated: Generated = None) -> moderngl.ComputeShader:
        """A compute program. Raises ShaderError."""
        source = assemble(name, defines, generated)
        if (source.text,) not in self._compute:
            try:
                self._compute[source.text,] = self._context.compute_shader(source.text)
            except moderngl.Error as error:
                raise ShaderError(_readable(str(error), [source])) from error
        return self._compute[source.text,]


def set_uniforms(program: moderngl.Program, values: Mapping[str, object]) -> None:
    """Those that the program reads; a variant may do without some."""
    for name, value in values.items():
        if name in program:
            program[name] = value


def set_textures(program: moderngl.Program, textures: Mapping[str, Texture | None]) -> None:
    """Those that the program reads, by the names of their samplers."""
    for unit, (name, texture) in enumerate(textures.items()):
        if texture and name in program:
            texture.use(unit)
            program[name] = unit


def set_uniform_bytes(program: moderngl.Program, name: str, values: bytes) -> None:
    """An array, as GLSL lays it out."""
    uniform = program[name]
    assert isinstance(uniform, moderngl.Uniform)
    uniform.write(values)


def _readable(message: str, sources: list[Source]) -> str:
    """moderngl heads its message with the stage that failed; that stage's source names the lines."""
    stages = {_STAGES.get(source.name.rpartition(".")[2], ""): source for source in sources}
    source = next((s for stage, s in stages.items() if stage and stage in message), sources[-1])
    lines = [line.strip() for line in source.locate(message).splitlines() if "error" in line.lower()]
    return f"{source.name}: " + "; ".join(lines or [message])
