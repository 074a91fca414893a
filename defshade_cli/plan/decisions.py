"""What a plan keeps and what it skips, each with the fact it follows from."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.planes import PLANES
from defshade_cli.plan.cost import covered_share
from defshade_cli.scene.coarse import INSTALL, can_be_coarse

if TYPE_CHECKING:
    from defshade_cli.plan.plan import Plan


@dataclass(frozen=True, slots=True)
class Decision:
    """One thing the plan chose, and the fact it follows from."""

    subject: str
    choice: str
    reason: str


def explain(plan: Plan) -> Iterator[Decision]:
    """Decision by decision, in the order of the pipeline."""
    yield from _of_planes(plan)
    yield from _of_lights(plan)
    yield from _of_shadows(plan)
    yield from _of_skies(plan)
    yield from _of_surfaces(plan)
    yield from _of_samples(plan)
    yield _explain_redrawing(plan)


def _of_planes(plan: Plan) -> Iterator[Decision]:
    yield Decision("layout", plan.layout, "as asked")
    converted = "authored colours are converted to it"
    yield Decision("render space", plan.render_space.name, "as authored" if plan.render_space.is_rec709 else converted)
    yield _explain_subdivision(plan)
    yield _explain_solids(plan)
    for plane in PLANES:
        kept = plane in plan.planes or plane in plan.data_planes
        yield _kept(f"plane {plane.name}", kept, "a material or layer needs it", "nothing needs it")


def _of_lights(plan: Plan) -> Iterator[Decision]:
    for volume in ("quad", "sphere", "cone"):
        count = sum(planned.volume == volume for planned in plan.lights)
        yield Decision(f"{volume} volumes", f"{count} drawn" if count else "skipped", "lights that reach geometry")
    if plan.lights:
        covered = f"volumes cover the image {covered_share(plan.lights, plan.camera):.1f} times"
        yield Decision("lighting", plan.lighting, covered)
    parts = bool(plan.outputs or plan.groups)
    yield _kept("light in parts", parts, "layers show lobes, groups or shadows", "no layer shows a part of the light")
    plain = "one sample of lights that are points"
    yield _kept("blur of highlights", plan.cell_parts > 0, "over what a sample stands for", plain)


def _of_shadows(plan: Plan) -> Iterator[Decision]:
    yield _explain_maps(plan)
    if plan.sharing_pixels > 1:
        yield Decision("a dome's shadows", "shared", f"by {plan.sharing_pixels} pixels, each of which looks up some")
    if plan.shadows:
        yield _explain_backs(plan)
        yield _explain_coarse(plan)
    yield _kept("IES profiles", bool(plan.profiles), "a light is shaped by one", "no light has one")
    yield _kept("shadow linking", plan.shadow_linked, "a light chooses its casters", "everything casts shadows")


def _of_skies(plan: Plan) -> Iterator[Decision]:
    yield _kept("environment", bool(plan.domes), "a dome lights the scene", "no dome")
    yield _explain_rays(plan)
    if plan.portals:
        yield Decision("portals", "passed over", "hints: domes are sampled by their radiance")


def _of_surfaces(plan: Plan) -> Iterator[Decision]:
    yield _kept("cutout", plan.cutout, "some opacity is or may be below 1", "no opacity is below 1")
    if plan.solid:
        solid = "1 wherever they are seen: these surfaces are solid"
        yield Decision("opacity images", f"{plan.solid} passed over", solid)
    glass = "some opacity scales the diffuse alone: lobes stay"
    yield _kept("transparency", plan.transparent, glass, "no opacity does that")
    yield _kept("textures", plan.textures, "a material reads them", "no material reads any")


def _of_samples(plan: Plan) -> Iterator[Decision]:
    yield _explain_motion(plan)
    if plan.data_layers:
        jittered, shared = "the beauty's is jittered, quantised or dithered", "the beauty's own float sample serves"
        yield _kept("data GBuffer", plan.data_pass, jittered if plan.sampled else "as asked", shared)
    yield _kept("error estimate", plan.tracks_error, "as asked", "nothing needs it")
    if not plan.lit:
        yield Decision("lighting", "skipped", "no layer needs it")


def _explain_maps(plan: Plan) -> Decision:
    if not plan.shadows:
        return Decision("shadow maps", "skipped", "no light casts any, or none were asked")
    side = plan.shadow_resolution
    return Decision("shadow maps", f"{side} x {side}", f"{plan.maps_a_sample} a sample at most")


def _explain_backs(plan: Plan) -> Decision:
    if not plan.closed:
        return Decision("backs of casters", "drawn", "no large closed mesh, or few maps")
    return Decision("backs of casters", f"skipped of {len(plan.closed)}", "closed meshes, whose fronts shade alike")


def _explain_coarse(plan: Plan) -> Decision:
    if plan.coarse:
        off = f"off by about 1/{1.0 / plan.coarse_share:.0f} of a map's texel, where that saves triangles"
        return Decision("coarser casters", f"{len(plan.coarse)} in shadow maps", off)
    return Decision("coarser casters", "none", "no large solid mesh, or few maps" if can_be_coarse() else INSTALL)


def _explain_rays(plan: Plan) -> Decision:
    if not plan.lobe_rays:
        few = "no dome, no lamp large enough for the lobes there are, or opacity, linked shadows or too many triangles"
        return Decision("rays along lobes", "skipped", few)
    seen = sum(planned.by_rays for planned in plan.lights)
    reason = f"lobes below roughness {plan.roughest_rays:.2f} see {seen} of {len(plan.lights)} lights by them"
    return Decision("rays along lobes", f"{plan.lobe_rays} a sample", reason)


def _explain_subdivision(plan: Plan) -> Decision:
    if not plan.levels:
        return Decision("subdivision", "skipped", "no subdivision surface")
    least, most = plan.levels[0], plan.levels[-1]
    levels = f"{least} levels" if least == most else f"{least} to {most} levels"
    reason = "by the surfaces' size in the image" if plan.complexity == "auto" else f"complexity {plan.complexity}"
    return Decision("subdivision", levels, reason)


def _explain_solids(plan: Plan) -> Decision:
    if not plan.coarse_solids:
        return Decision("coarse solids", "none", "none, or large in the image, or too few to count")
    return Decision("coarse solids", f"{plan.coarse_solids} meshes", "small in the image, and many")


def _explain_motion(plan: Plan) -> Decision:
    if not plan.moments:
        return Decision("motion blur", "skipped", "one sample, a still stage, a closed shutter, or not asked")
    opens, closes = plan.camera.shutter
    return Decision("motion blur", f"{plan.moments} moments", f"the shutter is open from {opens:g} to {closes:g}")


def _explain_redrawing(plan: Plan) -> Decision:
    redrawing = plan.redrawing
    if redrawing.boxes is None:
        return Decision("redrawing", "all", redrawing.reason)
    return Decision(
        "redrawing", "a part", f"instances that changed since the frame before, {redrawing.moved}, and their shadows"
    )


def _kept(subject: str, kept: bool, why: str, why_not: str) -> Decision:
    return Decision(subject, "kept" if kept else "skipped", why if kept else why_not)
