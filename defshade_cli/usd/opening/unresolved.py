"""References, payloads and sublayers that lead nowhere: what they hold is missing in the picture, and that is said."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from pxr import Usd

from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.opening.diagnostics import described

_MOST_NAMED = 6


class Unresolved(NamedTuple):
    """prim: where the arc is.  text: USD's own.  reason: what does not exist, in a few words."""

    prim: str
    text: str
    reason: str

    @property
    def unsupported(self) -> Unsupported:
        """The same as what a render leaves out."""
        return Unsupported(self.prim, self.reason)


def find_unresolved(stage: Usd.Stage) -> tuple[Unresolved, ...]:
    """What USD could not compose of the stage as it is populated now, in the order of the prims."""
    found = ((str(error.rootSite.path), described(error)) for error in stage.GetCompositionErrors())
    return tuple(Unresolved(prim, text, _reason(text)) for prim, text in sorted(found))


def summary(unresolved: Sequence[Unresolved]) -> str:
    """All of them in one line, those that lack the same together."""
    return f"the stage is incomplete: {by_reason(arc.unsupported for arc in unresolved)}"


def by_reason(issues: Iterable[Unsupported]) -> str:
    """In one line, the prims of one reason together."""
    prims = defaultdict(list)
    for issue in issues:
        prims[issue.reason].append(issue.path)
    parts = [f"{reason} ({paths[0]}{_more(len(paths) - 1)})" for reason, paths in list(prims.items())[:_MOST_NAMED]]
    return f"{'; '.join(parts)}{_more(len(prims) - _MOST_NAMED)}"


def _reason(text: str) -> str:
    """Of "Could not open asset @a.usd@ for reference introduced by @b.usd@</Prim>." the part before the layer's."""
    first, *_ = text.splitlines()
    headline = first.partition(" introduced by ")[0].partition("; skipping")[0].rstrip(".:")
    return headline[:1].lower() + headline[1:]


def _more(count: int) -> str:
    return f" and {count} more" if count > 0 else ""
