"""MaterialX's `surface_unlit`: light that is the same from all sides, and no reflection."""

from __future__ import annotations

from defshade_cli.usd.materials.materialx.surface import Model, Translation


def _translate(to: Translation) -> None:
    to.values.update(diffuse_color=(0.0, 0.0, 0.0), metallic=1.0, roughness=1.0, opacity_mode="presence")
    to.put_product("emissive_color", "emission", "emission_color")
    to.put("opacity", to["opacity"], "opacity")


UNLIT = Model(
    defaults={"emission": 1.0, "emission_color": (1.0, 1.0, 1.0), "opacity": 1.0},
    left_out={"transmission": (0.0, "")},
    translate=_translate,
)
