"""What a light adds to a pixel besides its radiance: one table, from which the shaders' outputs are generated.

Each output has the name of the layer that shows it. A group is a sum of some lights' radiance; a light is in at most
`MOST_TARGETS` − 1 − outputs of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from defshade_cli.gpu.planes import MOST_TARGETS

OUTPUTS: dict[str, str] = {
    "diffuse": "vec4(lit.diffuse, 0.0)",
    "specular": "vec4(lit.radiance - lit.diffuse, 0.0)",
    "shadow": "vec4(lit.arrived, lit.sent, 0.0, 0.0)",
    "lightComplexity": "vec4(lit.volumes)",
}
"""Layer → GLSL value from `Lit lit`."""

_NO_LIGHT = "Lit(vec3(0.0), vec3(0.0), 0.0, 0.0, 1.0)"


def most_groups(outputs: Sequence[str]) -> int:
    """Groups that one light can be in beside these outputs."""
    return MOST_TARGETS - 1 - len(outputs)


def output_defines(outputs: Sequence[str]) -> list[str]:
    """SPLIT: the shaders tell lobes apart."""
    return ["SPLIT"] * bool({"diffuse", "specular"} & set(outputs))


def outputs_source(outputs: Sequence[str], groups: int) -> str:
    """GLSL: the targets, `void write_light(Lit lit)`, and `void write_nothing()` for a volume whose light adds none."""
    values = [OUTPUTS[name] for name in outputs] + ["vec4(lit.radiance, 0.0)"] * groups
    targets = [f"layout(location = {i}) out vec4 light_output_{i};" for i in range(1, len(values) + 1)]
    body = [f"    light_output_{i} = {value};" for i, value in enumerate(values, 1)]
    counted = "lightComplexity" in outputs
    return "\n".join(
        [
            '#include "lib/lit.glsl"',
            "layout(location = 0) out vec4 radiance;",
            *targets,
            "void write_light(Lit lit) {",
            "    radiance = vec4(lit.radiance, 0.0);",
            *body,
            "}",
            "void write_nothing() {",
            f"    write_light({_NO_LIGHT});" if counted else "    discard;",
            "}",
        ]
    )
