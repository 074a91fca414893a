"""How a stage is read, whatever the time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.extras import NO_EXTRAS, Extras
from defshade_cli.scene.texture import SeenFrom
from defshade_cli.settings import Complexity

if TYPE_CHECKING:
    from defshade_cli.scene.framing import Framing, Held


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """camera: path or name; without it the rule of usd/camera.py picks.

    purposes: of the geometry that is drawn; without them those of the render settings.
    render_settings, product: paths of their prims; settings are found as usd/render_settings/products.py does.
    complexity: of subdivision surfaces and, where it is not `auto`, of solids as Hydra makes cages of them; for `auto`
        it matters how large the image is, in pixels: see scene.camera.image_size for size and width.
    framing: a camera of ours in place of the stage's.  studio: lights of ours where the stage has none.
    extras: what only some layers need.  seen_from: for cards placed by their textures, which reads their headers.
    """

    camera: str | None = None
    purposes: Sequence[str] | None = None
    render_settings: str | None = None
    product: str = ""
    complexity: Complexity = "auto"
    size: tuple[int, int] | None = None
    width: int | None = None
    framing: Framing | Held | None = None
    studio: bool = False
    extras: Extras = NO_EXTRAS
    seen_from: SeenFrom | None = None

    @property
    def as_cages(self) -> bool:
        """Are solids cages of few faces?"""
        return self.complexity != "auto"


AS_IT_IS = ReadOptions()
"""Nothing is asked for beyond what the stage says."""
