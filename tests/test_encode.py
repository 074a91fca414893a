"""The packed GBuffer's encodings, as the shader has them: every value comes back to within half a step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu

_SOURCE = """
#include "lib/encode.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Given { vec4 given[]; };
layout(std430, binding = 1) writeonly buffer Found { vec4 found[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(given.length())) return;
    vec3 bytes = round(BYTES * 255.0) / 255.0;
    found[i] = vec4(BACK, max(max(bytes.x, bytes.y), bytes.z));
}
"""


class Encoding:
    """There and back through three bytes."""

    def __init__(self, gpu: Gpu, name: str, there: str, back: str) -> None:
        source = _SOURCE.replace("BYTES", f"{there}(given[i].xyz)").replace("BACK", f"{back}(bytes)")
        self._context, self._program = gpu.context, gpu.shaders.compute(name, (), {name: source})

    def through(self, values: NDArray) -> NDArray[np.float32]:
        """(N, 4): what comes back of (N, 3), and the greatest byte over 255."""
        padded = np.zeros((len(values), 4), np.float32)
        padded[:, :3] = values
        given, found = self._context.buffer(padded.tobytes()), self._context.buffer(reserve=padded.nbytes)
        given.bind_to_storage_buffer(0)
        found.bind_to_storage_buffer(1)
        self._program.run(-(-len(values) // 64))
        return np.frombuffer(found.read(), np.float32).reshape(-1, 4)


@pytest.fixture(scope="module")
def normals(gpu: Gpu) -> Encoding:
    return Encoding(gpu, "normal_probe.comp", "bytes_from_unit", "unit_from_bytes")


@pytest.fixture(scope="module")
def colors(gpu: Gpu) -> Encoding:
    return Encoding(gpu, "color_probe.comp", "srgb_from_linear", "linear_from_srgb")


_shared = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
components = st.floats(-1.0, 1.0, width=32)


@_shared
@given(st.lists(st.tuples(components, components, components), min_size=1, max_size=200))
def test_any_normal_comes_back_within_the_octahedral_bound(
    normals: Encoding, drawn: list[tuple[float, float, float]]
) -> None:
    """0.0589° at most (Cigolle et al. 2014), also along edges and folds of the octahedron."""
    vectors = np.array([v for v in drawn if np.linalg.norm(v) > 1e-6] or [(0, 0, -1)], np.float64)
    units = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    found = normals.through(units)
    assert (found[:, 3] <= 1.0).all()
    sine = np.linalg.norm(np.cross(units, found[:, :3]), axis=1)
    assert (np.einsum("ij,ij->i", units, found[:, :3]) > 0.0).all()
    assert np.degrees(np.arcsin(sine.max())) < 0.0592


@_shared
@given(st.lists(st.tuples(*[st.floats(0.0, 1.0, width=32)] * 3), min_size=1, max_size=200))
def test_any_colour_comes_back_within_half_a_step(colors: Encoding, drawn: list[tuple[float, float, float]]) -> None:
    values = np.array(drawn)
    found = colors.through(values)[:, :3]
    encoded = np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    back = np.where(found <= 0.0031308, 12.92 * found, 1.055 * np.maximum(found, 0) ** (1 / 2.4) - 0.055)
    assert np.abs(encoded - back).max() <= 0.5 / 255 + 1e-4


def test_colours_beyond_are_the_nearest_within(colors: Encoding) -> None:
    found = colors.through(np.array([(-1.0, 2.0, 1e30)]))
    np.testing.assert_allclose(found[0, :3], (0.0, 1.0, 1.0), atol=1e-6)
