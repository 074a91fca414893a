"""Materials that are bound to a prim, by purpose, and how what is bound above and below goes together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pxr import Sdf

PURPOSES = ("full", "preview", "")
"""Of bindings, in order of preference where render settings have none; the empty name is for all purposes."""


class Binding(NamedTuple):
    """material: its path, whether or not it exists; stronger: than what is bound further down."""

    material: Sdf.Path
    stronger: bool


class Bindings(NamedTuple):
    """The bindings of a prim by purpose, in order of preference."""

    full: Binding | None = None
    preview: Binding | None = None
    all_purpose: Binding | None = None

    def under(self, above: Bindings) -> Bindings:
        """These as they resolve below a prim that has `above`."""
        return Bindings(*(_stronger(here, there) for here, there in zip(self, above, strict=True)))

    @property
    def candidates(self) -> tuple[Sdf.Path, ...]:
        """Material paths, the preferred first."""
        return self.candidates_for(PURPOSES)

    def candidates_for(self, purposes: Sequence[str]) -> tuple[Sdf.Path, ...]:
        """Material paths in the order of `purposes`, as UsdRenderSettings names them."""
        if not any(self):
            return ()
        by_purpose = {"full": self.full, "preview": self.preview, "": self.all_purpose, "allPurpose": self.all_purpose}
        chosen = (by_purpose.get(purpose) for purpose in purposes)
        return tuple(binding.material for binding in chosen if binding)


NOTHING_BOUND = Bindings()


def bound_to(material: str) -> Bindings:
    """For all purposes."""
    return Bindings(all_purpose=Binding(Sdf.Path(material), stronger=True))


def _stronger(here: Binding | None, there: Binding | None) -> Binding | None:
    return there if here is None or (there is not None and there.stronger) else here
