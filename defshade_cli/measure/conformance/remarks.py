"""Why some references have no silhouette, or one that ours cannot agree with: what their renderer does otherwise."""

from __future__ import annotations

from defshade_cli.measure.conformance.catalogue import Case
from defshade_cli.measure.conformance.results import LEAST_IOU

_DISCS = "Storm draws points as discs that face the image, a pixel narrower than they are; ours are spheres"
_VOLUME = "volumes are reported, not drawn"

_REASONS = {
    "testUsdImagingGLPoints": _DISCS,
    "testUsdImagingGLPoints_clipped": _DISCS,
    "testUsdImagingGLPoints_zoom": f"{_DISCS}: none wider than 100 pixels",
    "testUsdImagingGLPoints_zoom_pan": _DISCS,
    "testUsdImagingGLVaryingTopology_003": _DISCS,
    "testUsdImagingGLCurves": "at complexity 1.0 Storm draws curves as lines one pixel wide",
    "testUsdImagingGLVdbVolumeFallbackMaterial_001": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_002": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_003": _VOLUME,
}
"""By the reference's name."""


def remark_on(case: Case, iou: float | None) -> str:
    """One sentence without a full stop; empty where nothing needs saying."""
    if case.image is None or (iou is not None and iou >= LEAST_IOU):
        return ""
    if reason := _REASONS.get(case.image.stem):
        return reason
    if iou is not None:
        return ""
    return "conditions unknown: to look at" if case.maker == "viewer" else "a sky fills the background"
