"""GLSL structs to NumPy dtypes: shaders/lib/records.glsl is the only definition of what both sides share.

Layout: std430 (OpenGL 4.6 core §7.6.2.2). A vec3 aligns to 16 bytes and leaves room for a scalar behind it.
"""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from defshade_cli.resources import SHADERS

_STRUCT = re.compile(r"struct\s+(\w+)\s*\{(.*?)\}\s*;", re.DOTALL)
_FIELD = re.compile(r"(\w+)\s+(\w+)\s*;")
_COMMENT = re.compile(r"//[^\n]*")

_TYPES: dict[str, tuple[np.dtype, int]] = {
    "float": (np.dtype("f4"), 4),
    "int": (np.dtype("i4"), 4),
    "uint": (np.dtype("u4"), 4),
    "vec2": (np.dtype(("f4", 2)), 8),
    "vec3": (np.dtype(("f4", 3)), 16),
    "vec4": (np.dtype(("f4", 4)), 16),
    "uvec2": (np.dtype(("u4", 2)), 8),
    "uvec4": (np.dtype(("u4", 4)), 16),
    "mat4": (np.dtype(("f4", (4, 4))), 16),
}


@cache
def record(name: str) -> np.dtype:
    """The dtype of struct `name`; a mat4 field holds the transpose, since GLSL stores columns.

    Raises KeyError for a struct or a field type that records.glsl or this table lacks.
    """
    return record_of(_structs()[name])


def record_of(body: str) -> np.dtype:
    """The std430 dtype of a struct's body."""
    names, formats, offsets, end, alignment = [], [], [], 0, 4
    for type_name, field_name in _FIELD.findall(_COMMENT.sub("", body)):
        dtype, align = _TYPES[type_name]
        offset = -(-end // align) * align
        names.append(field_name)
        formats.append(dtype)
        offsets.append(offset)
        end, alignment = offset + dtype.itemsize, max(alignment, align)
    size = -(-end // alignment) * alignment
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


def block_source(name: str, count: int, binding: int) -> str:
    """GLSL: a uniform block of `count` records of struct `name`, and e.g. `Light light_at(uint index)` to read one.

    The block is an array of vec4: an array of structs has thousands of members, which take drivers long to link.
    """
    dtype, stem = record(name), name.lower()
    texels = dtype.itemsize // 16
    types = {field: kind for kind, field in _FIELD.findall(_structs()[name])}
    offsets = {field: of[1] for field, of in (dtype.fields or {}).items()}
    members = [f"    read.{field} = {_from_texels(types[field], at, stem)};" for field, at in offsets.items()]
    return "\n".join(
        [
            '#include "lib/records.glsl"',
            f"layout(std140, binding = {binding}) uniform {name}Texels {{ vec4 {stem}_texels[{texels * count}]; }};",
            f"{name} {stem}_at(uint index) {{",
            f"    uint first = index * {texels}u;",
            f"    {name} read;",
            *members,
            "    return read;",
            "}",
        ]
    )


def _from_texels(kind: str, offset: int, stem: str) -> str:
    texel, first = divmod(offset // 4, 4)
    value = f"{stem}_texels[first + {texel}u].{'xyzw'[first : first + _TYPES[kind][0].itemsize // 4]}"
    return f"floatBitsToUint({value})" if kind.startswith("u") else value


def literal(value: np.generic) -> str:
    """GLSL: the value of a float or uint field, to the bit."""
    if value.dtype.kind == "u":
        return f"{value}u"
    return f"uintBitsToFloat({np.float32(value).view(np.uint32)}u)"


@cache
def _structs() -> dict[str, str]:
    text = (SHADERS / "lib" / "records.glsl").read_text(encoding="utf-8")
    return dict(_STRUCT.findall(_COMMENT.sub("", text)))
