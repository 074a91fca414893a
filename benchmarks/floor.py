"""What no renderer of these libraries can go below: imports, a context, one full-screen draw, one PNG.

    python benchmarks/floor.py OUT.png [WIDTHxHEIGHT]

Time the whole process from outside, and set the time of `defshade render` against it.
"""

from __future__ import annotations

import sys

import moderngl
import numpy as np
import OpenImageIO as oiio
from pxr import Usd  # noqa: F401  imported for what that costs

_VERTEX = """#version 450
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""
_FRAGMENT = """#version 450
uniform vec2 size;
out vec4 color;
void main() { color = vec4(gl_FragCoord.xy / size, 0.5, 1.0); }
"""


def main(path: str, size: str = "1920x1080") -> None:
    width, height = map(int, size.split("x"))
    context = moderngl.create_standalone_context(backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
    program = context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
    program["size"] = width, height
    framebuffer = context.framebuffer([context.texture((width, height), 4)])
    framebuffer.use()
    context.vertex_array(program, []).render(vertices=3)
    pixels = np.frombuffer(framebuffer.read(components=4), np.uint8).reshape(height, width, 4)
    encoder = oiio.ImageOutput.create(path)
    encoder.open(path, oiio.ImageSpec(width, height, 4, "uint8"))
    encoder.write_image(pixels)
    encoder.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
