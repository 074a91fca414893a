"""Why some references have no silhouette, or one that ours cannot agree with: what their renderer does otherwise."""

from __future__ import annotations

from defshade_cli.measure.conformance.catalogue import Case
from defshade_cli.measure.conformance.results import LEAST_IOU
from defshade_cli.measure.conformance.silhouette import Noise

_VOLUME = "volumes are reported, not drawn"

_REASONS = {
    "testUsdImagingGLVdbVolumeFallbackMaterial_001": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_002": _VOLUME,
    "testUsdImagingGLVdbVolumeFallbackMaterial_003": _VOLUME,
}
"""By the reference's name."""


def remark_on(case: Case, iou: float | None, noise: Noise | None = None) -> str:
    """One sentence without a full stop; empty where nothing needs saying, or nothing excuses what is short."""
    if case.image is None or (iou is not None and iou >= LEAST_IOU):
        return ""
    if reason := _REASONS.get(case.image.stem):
        return reason
    if iou is not None:
        return _noisy(noise) if noise and iou >= noise.low else ""
    return "conditions unknown: to look at" if case.maker == "viewer" else "a sky fills the background"


def _noisy(noise: Noise) -> str:
    return f"{noise.samples} random samples a pixel of ours agree with it to {noise.mean:.4f}"
