"""What became of each case, and the bound that silhouettes are held to."""

from __future__ import annotations

from dataclasses import asdict, field
from typing import Any, Self

from defshade_cli.dataclass import dataclass
from defshade_cli.measure.conformance.catalogue import Case

LEAST_IOU = 0.99


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a case.

    iou: of the silhouettes; rmse: of the 8-bit pictures in [0, 1]. None where the reference does not allow it.
    remark: why there is no silhouette to compare, or why it cannot agree.
    error: why there is no picture of ours.
    unsupported: what of the stage was left out, `path: reason` each.  warnings: what was logged.
    pictures: "ours", "reference" and "difference" → file names.
    """

    key: str
    item: str
    stage: str
    reference: str
    maker: str
    iou: float | None = None
    rmse: float | None = None
    remark: str = ""
    error: str = ""
    unsupported: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    pictures: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def fails(self) -> bool:
        """Not rendered, or a silhouette that should agree does not."""
        return bool(self.error) or (self.iou is not None and self.iou < LEAST_IOU and not self.remark)

    def as_json(self) -> dict[str, Any]:
        """The fields, for JSON."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """A result as `as_json` gave it."""
        lists = {name: tuple(data[name]) for name in ("unsupported", "warnings")}
        return cls(**data | lists)


def result_of(case: Case, **outcome: Any) -> Result:
    """A case's result; `outcome`: fields of Result beyond what the case says."""
    reference = case.image.name if case.image else ""
    return Result(case.key, case.item, case.stage_name, reference, case.maker, **outcome)
