"""How far two images are apart, layer by layer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf, log10, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.image.colour import Pixels
from defshade_cli.image.layers import BEAUTY, LAYERS
from defshade_cli.image.perception import delta_e, flip_map
from defshade_cli.image.reading import read

Image = Path | NDArray[Any] | Mapping[str, NDArray[Any]]
"""A file, the pixels (H, W, C) of a beauty, or layers by name."""

REL_MSE_EPSILON = 1e-2


@dataclass(frozen=True, slots=True)
class Comparison:
    """One layer of image a against the reference b, over the values that are finite in both.

    rmse: root of the mean squared difference.
    rel_mse: mean of (a − b)² / (b² + ε), ε = 0.01 (Rousselle, Knaus, Zwicker, "Adaptive Sampling and Reconstruction
        using Greedy Error Minimization", SIGGRAPH Asia 2011).
    max_error: largest difference.
    psnr: 20 log10(peak / rmse) in dB, the peak being 1 or b's largest magnitude if greater; inf for equal images.
    flip: mean FLIP error (Andersson et al. 2020; HDR-FLIP 2021) of a colour layer; None for data, on request, and
        where the package flip-evaluator is missing.
    delta_e: mean CIE ΔE2000 of a colour layer, on request.
    nonfinite: pixels of a and of b with a NaN or an infinity.
    unmatched: pixels whose NaN or infinity the other image does not share. They are in none of the errors.
    """

    layer: str
    rmse: float
    rel_mse: float
    max_error: float
    psnr: float
    flip: float | None
    delta_e: float | None
    pixels: int
    nonfinite: tuple[int, int]
    unmatched: int

    def within(self, threshold: float) -> bool:
        """Whether the images agree to an RMSE of `threshold`; a NaN that one alone has never does."""
        return self.unmatched == 0 and self.rmse <= threshold


def compare(
    a: Image, b: Image, layers: Iterable[str] | None = None, *, flip: bool = True, colour: bool = False
) -> tuple[Comparison, ...]:
    """Compare a with the reference b over `layers`, or over those that both have.

    flip: also HDR-FLIP for scene-linear images (seconds a megapixel), or LDR-FLIP for pictures, by b's suffix.
    colour: also ΔE2000, likewise.
    Raises UsageError where a layer is missing or sizes differ, OutputError for a file that cannot be read.
    """
    first, second = _layers_of(a), _layers_of(b)
    display_referred = is_picture(b)
    names = tuple(layers) if layers is not None else tuple(name for name in second if name in first)
    if not names:
        raise UsageError(f"no layer in common: {', '.join(first)} against {', '.join(second)}")
    results = []
    for name in names:
        pair = _paired(name, first, second)
        seen = _has_color(name) and pair[0].shape[-1] >= 3
        seen_errors = (
            _mean(flip_map(*pair, display_referred)) if flip and seen else None,
            _mean(delta_e(*pair, display_referred)) if colour and seen else None,
        )
        results.append(_compare(name, *pair, *seen_errors))
    return tuple(results)


def is_picture(image: Image) -> bool:
    """A file that is display-encoded; all else is scene-linear."""
    return isinstance(image, Path) and image.suffix.lower() != ".exr"


def _mean(values: NDArray[Any] | None) -> float | None:
    return None if values is None else float(values.mean())


def difference(a: NDArray[Any], b: NDArray[Any]) -> Pixels:
    """|a − b| (H, W, C); 0 where both hold the same infinity or NaN, inf where one alone does."""
    a, b = np.asarray(a, np.float32), np.asarray(b, np.float32)
    with np.errstate(invalid="ignore"):
        apart = np.abs(a - b)
    odd = ~np.isfinite(apart)
    same = (a[odd] == b[odd]) | (np.isnan(a[odd]) & np.isnan(b[odd]))
    apart[odd] = np.where(same, 0.0, inf)
    return apart


def _layers_of(image: Image) -> Mapping[str, NDArray[Any]]:
    if isinstance(image, Path):
        return read(image)
    return image if isinstance(image, Mapping) else {BEAUTY: np.asarray(image)}


def _paired(
    name: str, first: Mapping[str, NDArray[Any]], second: Mapping[str, NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Both images' pixels, cut to the channels that both have: an opaque picture may lack alpha."""
    for layers in (first, second):
        if name not in layers:
            raise UsageError(f"layer '{name}' is missing: there are {', '.join(layers)}")
    a, b = first[name], second[name]
    if a.shape[:2] != b.shape[:2]:
        raise UsageError(f"{name}: {a.shape[1]}x{a.shape[0]} against {b.shape[1]}x{b.shape[0]} pixels")
    channels = min(a.shape[2], b.shape[2])
    return a[..., :channels], b[..., :channels]


def _compare(name: str, a: NDArray[Any], b: NDArray[Any], flip: float | None, delta_e: float | None) -> Comparison:
    apart = difference(a, b)
    odd_a, odd_b = ~np.isfinite(a), ~np.isfinite(b)
    both = ~(odd_a | odd_b)
    errors, reference = apart[both].astype(np.float64), b[both].astype(np.float64)
    squares = errors**2
    rmse = sqrt(squares.mean()) if squares.size else 0.0
    peak = max(1.0, float(np.abs(reference).max(initial=0.0)))
    return Comparison(
        layer=name,
        rmse=rmse,
        rel_mse=float((squares / (reference**2 + REL_MSE_EPSILON)).mean()) if squares.size else 0.0,
        max_error=float(errors.max(initial=0.0)),
        psnr=20.0 * log10(peak / rmse) if rmse > 0 else inf,
        flip=flip,
        delta_e=delta_e,
        pixels=a.shape[0] * a.shape[1],
        nonfinite=(int(odd_a.any(axis=-1).sum()), int(odd_b.any(axis=-1).sum())),
        unmatched=int(np.isinf(apart).any(axis=-1).sum()),
    )


def _has_color(name: str) -> bool:
    return name not in LAYERS or LAYERS[name].is_color
