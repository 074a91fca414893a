"""What a stage asks to be made of it: images, and what is in them."""

from __future__ import annotations

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Variable:
    """One thing that an image holds: UsdRenderVar.

    name: of the prim, which names the channels.  source: its sourceName, else the prim's name.
    source_type: raw, primvar, lpe or intrinsic.  data_type: as a USD attribute type, such as color3f.
    """

    name: str
    source: str
    source_type: str = "raw"
    data_type: str = "color3f"

    @property
    def width(self) -> int:
        """Channels that the type has."""
        return next((int(digit) for digit in self.data_type if digit.isdigit()), 1)


@dataclass(frozen=True, slots=True)
class Product:
    """An image that a stage's render settings name: UsdRenderProduct.

    path: of the prim; empty for settings without products.  file: its productName at one time.
    """

    path: str = ""
    file: str = ""
    variables: tuple[Variable, ...] = ()

    @property
    def name(self) -> str:
        """The prim's name."""
        return self.path.rpartition("/")[2]
