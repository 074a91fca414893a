"""Runs functions of shaders/lib on the GPU for arrays of inputs, so that tests can integrate the code that renders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.records import record_of
from defshade_cli.measure.brdf import Surface
from defshade_cli.settings import Shading

_GROUP = 64
_PROBE = """
    vec3 normal;
    float metallic;
    vec3 view;
    float roughness;
    vec3 light;
    float clearcoat;
    vec3 base;
    float clearcoat_roughness;
    vec3 f0;
    vec3 f90;
    vec2 response;
"""
_SOURCE = f"""
#include "lib/surface.glsl"

struct Probe {{{_PROBE}}};

layout(local_size_x = {_GROUP}) in;
layout(std430, binding = 0) readonly buffer Probes {{ Probe probes[]; }};
layout(std430, binding = 1) writeonly buffer Results {{ vec4 results[]; }};

void main() {{
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(probes.length())) return;
    Probe p = probes[i];
    Surface s = Surface(p.normal, p.base, p.metallic, p.roughness, vec3(0.0), p.f0, p.f90,
                        p.clearcoat, p.clearcoat_roughness, BLUR FOOTPRINT);
    vec3 h = normalize(p.view + p.light);
    float D = D_blurred(GGX_alpha(s.roughness), s.blur, s.normal, h);
    results[i] = vec4(evaluate_brdf(s, p.view, p.light, p.response.xyy), D);
}}
"""


class BrdfHarness:
    """shaders/lib/surface.glsl behind the signature of measure.brdf; clearcoat always compiled in.

    blur: of the lobes, in alpha²; with none, as the shaders are that know of none.
    """

    def __init__(self, gpu: Gpu, shading: Shading, blur: float = 0.0) -> None:
        defines = ["PLANE_CLEARCOAT", f"BLUR {blur:.9f}"]
        defines += ["CLASSIC"] * (shading == "classic") + ["PATCHES"] * (blur > 0)
        defines += ["FOOTPRINT , POINT" if blur > 0 else "FOOTPRINT"]
        self._context = gpu.context
        self._program = gpu.shaders.compute("brdf_probe.comp", defines, {"brdf_probe.comp": _SOURCE})

    def evaluate_brdf(
        self, surface: Surface, light: NDArray, response: tuple[float, float] = (1.0, 1.0)
    ) -> NDArray[np.float64]:
        """(P, 3) f · NoL for light directions (P, 3)."""
        return self._run(surface, light, response)[:, :3]

    def distribution(self, surface: Surface, half: NDArray) -> NDArray[np.float64]:
        """(P,) D at half vectors (P, 3): the view and the light both lie along them."""
        return self._run(surface, half, (1.0, 1.0), view=half)[:, 3]

    def _run(
        self, surface: Surface, light: NDArray, response: tuple[float, float], view: NDArray | None = None
    ) -> NDArray[np.float64]:
        probes = np.zeros(len(light), record_of(_PROBE))
        for name in set(probes.dtype.names) - {"light", "response", "view"}:
            probes[name] = getattr(surface, name)
        probes["view"] = surface.view if view is None else view
        probes["light"], probes["response"] = light, response
        inputs = self._context.buffer(probes.tobytes())
        outputs = self._context.buffer(reserve=16 * len(probes))
        inputs.bind_to_storage_buffer(0)
        outputs.bind_to_storage_buffer(1)
        self._program.run(-(-len(probes) // _GROUP))
        results = np.frombuffer(outputs.read(), np.float32).reshape(-1, 4).astype(np.float64)
        inputs.release()
        outputs.release()
        return results
