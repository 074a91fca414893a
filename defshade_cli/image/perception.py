"""Differences as they are seen: FLIP and ΔE2000, pixel by pixel."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from math import log2
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.colour import BRIGHTEST, Pixels

REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)


def flip_map(a: NDArray[Any], b: NDArray[Any], display_referred: bool) -> Pixels | None:
    """(H, W) FLIP error of RGB against the reference b: Andersson et al. 2020, for scene-linear images HDR-FLIP, 2021.

    Values are clamped to what it is defined for: [0, 1] in pictures, ≥ 0 in scene-linear images. None where the package
    flip-evaluator is missing.
    """
    if find_spec("flip_evaluator") is None:
        return None
    return np.squeeze(_evaluate(a, b, display_referred, magma=False))


def heat_map(a: NDArray[Any], b: NDArray[Any], display_referred: bool) -> Pixels:
    """(H, W, 3) the FLIP error in the colours of magma, black for none. Needs the package flip-evaluator."""
    return _evaluate(a, b, display_referred, magma=True)


def _evaluate(a: NDArray[Any], b: NDArray[Any], display_referred: bool, *, magma: bool) -> Pixels:
    import flip_evaluator

    brightest = 1.0 if display_referred else BRIGHTEST
    test, reference = (np.nan_to_num(rgb[..., :3]).clip(0.0, brightest) for rgb in (a, b))
    parameters = {} if display_referred else _exposures(reference)
    mode = "LDR" if display_referred else "HDR"
    return flip_evaluator.evaluate(reference, test, mode, applyMagma=magma, parameters=parameters)[0]


def delta_e(a: NDArray[Any], b: NDArray[Any], display_referred: bool) -> NDArray[np.float64]:
    """(H, W) CIE ΔE2000 of RGB with Rec.709 primaries, sRGB-encoded in pictures: Sharma, Wu, Dalal 2005.

    White is 1; what is brighter or negative is clamped, as on a display.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science tells of the optional packages it misses
        import colour

        lab = []
        for rgb in (a, b):
            shown = np.nan_to_num(rgb[..., :3]).clip(0.0, 1.0).astype(np.float64)
            lab.append(colour.XYZ_to_Lab(colour.sRGB_to_XYZ(shown, apply_cctf_decoding=display_referred), _D65))
        return np.asarray(colour.difference.delta_E_CIE2000(lab[0], lab[1]), np.float64)


_D65 = (0.3127, 0.3290)


def _exposures(reference: NDArray[Any]) -> dict[str, float]:
    """HDR-FLIP's range of exposures in stops, the median taken over lit pixels.

    The evaluator's own median is 0 where a black background fills half the image, and it then ends the process.
    x is where its tone curve, Narkowicz's ACES fit of 0.6 x, passes 0.85 (Andersson et al. 2021, section 4):
    0.85 = x(2.51x + 0.03) / (x(2.43x + 0.59) + 0.14).
    """
    luminance = reference @ np.array(REC709_LUMINANCE)
    lit = luminance[luminance > 0]
    if not lit.size:
        return {"startExposure": 0.0, "stopExposure": 0.0}
    x = max(np.roots([2.51 - 0.85 * 2.43, 0.03 - 0.85 * 0.59, -0.85 * 0.14])) / 0.6
    start, stop = log2(x / lit.max()), log2(x / np.median(lit))
    return {"startExposure": start, "stopExposure": stop}
