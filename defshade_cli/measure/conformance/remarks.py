"""Why some references have no silhouette, or one that ours cannot agree with: what their renderer does otherwise."""

from __future__ import annotations

from defshade_cli.measure.conformance.catalogue import Case
from defshade_cli.measure.conformance.results import LEAST_IOU

_VOLUME = "volumes are reported, not drawn"

_REASONS = {
    "testUsdImagingGLVdbVolumeFallbackMaterial_001": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_002": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_003": _VOLUME,
    "test_2300/data/test.usda": "a border of 55 pixels by 16 samples: so many of our own agree no better",
}
"""By the reference's name, or the stage's."""


def remark_on(case: Case, iou: float | None) -> str:
    """One sentence without a full stop; empty where nothing needs saying."""
    if case.image is None or (iou is not None and iou >= LEAST_IOU):
        return ""
    if reason := _REASONS.get(case.image.stem, _REASONS.get(case.stage_name)):
        return reason
    if iou is not None:
        return ""
    return "conditions unknown: to look at" if case.maker == "viewer" else "a sky fills the background"
