"""Opening a stage, and what it says about itself as a whole."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path, PurePath
from typing import Any

from pxr import Usd, UsdGeom, UsdUtils

from defshade_cli.settings import Composition
from defshade_cli.usd.materials.materialx.documents import is_about_documents, supply_documents
from defshade_cli.usd.opening.composition import compose
from defshade_cli.usd.opening.diagnostics import commentary
from defshade_cli.usd.opening.unresolved import find_unresolved, summary

log = logging.getLogger("defshade")

_ADDRESS = re.compile(r"\s*<0x[0-9a-f]+>")
_AROUND = re.compile(r"\AIn <[^>]*>: | \((?:instantiating|recomposing) stage on [^)]*\)\Z")
_AS_AUTHORED = Composition()


def open_stage(path: Path, composition: Composition = _AS_AUTHORED, camera: str | None = None) -> Usd.Stage:
    """Open a .usd, .usda, .usdc or .usdz file. What it refers to and is missing is logged.

    camera: as the user names it, which a mask does not hide.  Raises as usd.opening.composition.compose:
    StageNotFound, StageError, PrimNotFound.
    """
    with gathered_diagnostics() as told:
        stage = compose(path, composition, camera)
        unresolved = find_unresolved(stage)
        told.update(arc.text for arc in unresolved)
        if any(is_about_documents(arc.text) for arc in unresolved):
            supply_documents(stage)
            unresolved = tuple(arc for arc in find_unresolved(stage) if not is_about_documents(arc.text))
    if unresolved:
        log.warning("%s", summary(unresolved))
    return stage


@contextmanager
def gathered_diagnostics() -> Iterator[set[str]]:
    """Log what USD complains about inside the block, one line for each kind, in place of its own lines on stderr.

    Gives a set for the complaints that the block tells of itself.
    """
    delegate, told = UsdUtils.CoalescingDiagnosticDelegate(), set[str]()
    try:
        yield told
    finally:
        for kind in delegate.TakeCoalescedDiagnostics():
            complaints = [_ADDRESS.sub("", commentary(item)) for item in kind.unsharedItems]
            first, *more = [text for text in complaints if _core(text) not in told] or [""]
            if first:
                log.warning("USD: %s%s", first, f" (and {len(more)} more like it)" if more else "")


@contextmanager
def silence() -> Iterator[None]:
    """Say nothing inside the block: what there is to say of a frame was said when it was first read."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()

    def nothing(record: logging.LogRecord) -> bool:
        return False

    log.addFilter(nothing)
    try:
        yield
    finally:
        log.removeFilter(nothing)
        delegate.TakeCoalescedDiagnostics()


def may_change(stage: Usd.Stage) -> bool:
    """Is anything of the stage animated? Attributes are asked only where no layer has time samples: for splines."""
    layers = stage.GetUsedLayers(includeClipLayers=True)
    if any(layer.ListAllTimeSamples() for layer in layers):
        return True
    return any(attribute.HasSpline() for prim in _all_prims(stage) for attribute in prim.GetAuthoredAttributes())


def has_clips(stage: Usd.Stage) -> bool:
    """Do values come from value clips anywhere? What these alone say, is no authored property to USD."""
    return any(prim.HasAuthoredMetadata("clips") for prim in _all_prims(stage))


def _all_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Those of prototypes too."""
    return chain(stage.TraverseAll(), *(Usd.PrimRange.AllPrims(prototype) for prototype in stage.GetPrototypes()))


def stage_name(stage: Usd.Stage) -> str:
    """The root layer's file name without suffix."""
    return PurePath(stage.GetRootLayer().GetDisplayName()).stem


def up_axis(stage: Usd.Stage) -> str:
    """ "Y" or "Z"; anything else that is authored counts as Z, as it does for usdrecord's camera."""
    authored = _metadata(stage, UsdGeom.Tokens.upAxis) or UsdGeom.GetFallbackUpAxis()
    return "Y" if authored == UsdGeom.Tokens.y else "Z"


def meters_per_unit(stage: Usd.Stage) -> float:
    """As authored where it is a positive number, else USD's fallback of 0.01."""
    return _positive(stage, UsdGeom.Tokens.metersPerUnit, UsdGeom.LinearUnits.centimeters)


def frames_per_second(stage: Usd.Stage) -> float:
    """framesPerSecond, else timeCodesPerSecond, else 24, whichever first is a positive number."""
    return _positive(stage, "framesPerSecond", _positive(stage, "timeCodesPerSecond", 24.0))


def first_frame(stage: Usd.Stage) -> float | None:
    """The stage's startTimeCode; None, which stands for the default time, where no time range is authored."""
    return stage.GetStartTimeCode() if stage.HasAuthoredTimeCodeRange() else None


def _metadata(stage: Usd.Stage, key: str) -> Any:
    """Stage metadata of whatever type: old files hold floats where USD's own accessors raise on all but doubles."""
    return stage.GetPseudoRoot().GetMetadata(key)


def _positive(stage: Usd.Stage, key: str, fallback: float) -> float:
    value = _metadata(stage, key)
    if value is None:
        return fallback
    if isinstance(value, int | float) and 0.0 < value < math.inf:
        return float(value)
    log.warning("%s of %r counts as %g", key, value, fallback)
    return fallback


def _core(complaint: str) -> str:
    """A complaint of composition without the prim and the stage that USD puts around it."""
    return _AROUND.sub("", complaint)
