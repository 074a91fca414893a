"""By which paths users know prims."""

from __future__ import annotations

from pxr import Sdf, Usd


class Names:
    """Of the prims of one stage."""

    def __init__(self) -> None:
        self._first_instances: dict[str, str] = {}

    def shown(self, path: Sdf.Path | str) -> str:
        """The path by which users know a prim: for one inside a native prototype, its path in the first instance."""
        if not self._first_instances:
            return str(path)
        root, slash, below = str(path)[1:].partition("/")
        return self._first_instances.get(root, f"/{root}") + slash + below

    def on_stage(self, shown: str, beside: Sdf.Path) -> str:
        """Where the stage has what is shown at a path; `beside` is in the same prototype, or as it in none."""
        root = str(beside)[1:].partition("/")[0]
        first = self._first_instances.get(root)
        return f"/{root}{shown[len(first) :]}" if first and shown.startswith(f"{first}/") else shown

    def name_prototype(self, prototype: Usd.Prim, instance: Usd.Prim) -> str:
        """Show what stands in `prototype` as part of `instance`, or of the instance that came first."""
        return self._first_instances.setdefault(prototype.GetName(), self.shown(instance.GetPath()))
