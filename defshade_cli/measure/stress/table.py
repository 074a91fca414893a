"""The verdicts as the table of docs/stability.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from defshade_cli.measure.stress.corner import Corner
from defshade_cli.measure.stress.verdict import BOUND, Verdict

_HEADER = """| family | corners | worst error | where | NaN and Inf | refused | past the bound |
|---|---:|---:|---|---:|---:|---:|"""


def summary(verdicts: Iterable[Verdict]) -> str:
    """Markdown: one row a family, then what passes the bound and why, then what is refused with an error."""
    found = list(verdicts)
    families = [_row(name, list(those)) for name, those in groupby(found, lambda v: v.corner.family)]
    beyond = [
        f"- {v.corner.family}, {v.corner.name}: {v.worst:.1e}. {_reason(v.corner)}." for v in found if v.worst > BOUND
    ]
    refused = [f"- {v.corner.family}, {v.corner.name}: `{v.error}`" for v in found if v.error]
    return "\n".join([_HEADER, *families, "", "Past the bound:", "", *beyond, "", "Refused:", "", *refused])


def _reason(corner: Corner) -> str:
    return corner.why[:1].upper() + corner.why[1:] if corner.why else "A fault"


def _row(family: str, verdicts: Sequence[Verdict]) -> str:
    within = [v for v in verdicts if v.worst <= BOUND]
    worst = max(within, key=lambda v: v.worst)
    odd, refused = sum(v.odd for v in verdicts), sum(bool(v.error) for v in verdicts)
    place = f"{worst.corner.name}, pixel {worst.where[0]},{worst.where[1]}"
    beyond = len(verdicts) - len(within)
    return f"| {family} | {len(verdicts)} | {worst.worst:.1e} | {place} | {odd} | {refused} | {beyond} |"
