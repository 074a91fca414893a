"""Mitsuba 3, integrator `direct`: the USD stage through our own reader and converter, with UsdPreviewSurface
as a plugin.

So its picture converges to the same as ours, but for emitters that stand before others: those hide them there.
"""

from __future__ import annotations

import sys
from pathlib import Path

from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.mitsuba_plugins import mi
from defshade_cli.measure.pathtraced import mitsuba_world
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderSettings


def main(stage: str, image: str, width: int, height: int, samples: int) -> None:
    scene = first_frame(Path(stage))
    plan = make_plan(scene, RenderSettings(size=(width, height)))
    world = mi.load_dict(mitsuba_world(scene, plan, {"type": "direct", "hide_emitters": True}))
    mi.util.write_bitmap(image, mi.render(world, spp=samples), write_async=False)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:6]))
