"""The house is as docs/architecture.md draws it: imports go down, libraries keep to their rooms."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "defshade_cli"

FLOORS = (
    ("errors", "settings", "resources", "dataclass", "garbage"),
    ("spaces", "units"),
    ("scene",),
    ("image",),
    ("gpu",),
    ("usd", "plan", "passes"),
    ("rendering", "farm", "measure"),
    ("cli",),
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}

STRANGERS = {
    "usd": ("image", "gpu", "plan", "passes"),  # a Scene is all that leaves usd
    "passes": ("usd",),
    "plan": ("usd",),
}

FOREIGN = {
    "pxr": ("usd",),
    "MaterialX": ("usd",),
    "moderngl": ("gpu", "passes"),
    "glcontext": ("gpu",),
    "OpenImageIO": ("image",),
    "PyOpenColorIO": ("image",),
    "distributed": ("farm",),
    "meshoptimizer": ("scene",),
    "click": ("cli",),
    "rich": ("cli",),
    "mitsuba": ("measure",),
    "drjit": ("measure",),
}

MAX_LINES = 400


@dataclass(frozen=True)
class Import:
    """One imported module, where it stands, and whether Python follows it when the importer loads."""

    importer: str
    target: str
    place: str
    at_load: bool

    @property
    def room(self) -> str:
        return _room(self.importer)


def _room(module: str) -> str:
    """`defshade_cli.scene.light` → `scene`; the package itself → the empty name."""
    return module.partition(".")[2].partition(".")[0]


def _module(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {_module(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def _imports(module: str) -> Iterator[Import]:
    path = SOURCES[module]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    delayed = _delayed_lines(tree)
    for node in ast.walk(tree):
        for target in _targets(node, module):
            place = f"{path.relative_to(ROOT)}:{node.lineno}"  # type: ignore[attr-defined]
            yield Import(module, target, place, node.lineno not in delayed)  # type: ignore[attr-defined]


def _targets(node: ast.AST, module: str) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    assert node.level == 0, f"{module}:{node.lineno}: write imports in full, not relative"
    source = node.module or ""
    submodules = [f"{source}.{alias.name}" for alias in node.names]
    return [name if name in SOURCES else source for name in submodules]


def _delayed_lines(tree: ast.Module) -> set[int]:
    """Lines inside functions and `if TYPE_CHECKING` blocks."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        is_check = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if is_check or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            lines |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return lines


IMPORTS = [found for module in SOURCES for found in _imports(module)]
OWN = [found for found in IMPORTS if found.target.partition(".")[0] == PACKAGE.name]


def test_every_room_has_a_floor() -> None:
    rooms = {_room(module) for module in SOURCES} - {""}
    homeless = rooms - FLOOR_OF.keys()
    assert not homeless, f"give {sorted(homeless)} a floor here and in docs/architecture.md"


def test_imports_go_down() -> None:
    """The package's own __init__ is the front door: it opens on any floor and every floor may read it."""
    wrong = [
        f"{found.place}: {found.room} imports {found.target}, which stands a floor above it"
        for found in OWN
        if found.room and _room(found.target) and FLOOR_OF[_room(found.target)] > FLOOR_OF[found.room]
    ]
    assert not wrong, "\n".join(wrong)


def test_strangers_do_not_meet() -> None:
    wrong = [
        f"{found.place}: {found.room} imports {found.target}; scene is their only language"
        for found in OWN
        if _room(found.target) in STRANGERS.get(found.room, ())
    ]
    assert not wrong, "\n".join(wrong)


def test_foreign_libraries_keep_to_their_rooms() -> None:
    """Also inside functions and for types only."""
    wrong = [
        f"{found.place}: {library} belongs in {' and '.join(FOREIGN[library])} alone"
        for found in IMPORTS
        if (library := found.target.partition(".")[0]) in FOREIGN and found.room not in FOREIGN[library]
    ]
    assert not wrong, "\n".join(wrong)


def test_dataclasses_are_the_cheap_ones() -> None:
    wrong = [
        f"{place}: import dataclass from {PACKAGE.name}.dataclass"
        for module, path in SOURCES.items()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module == "dataclasses" and module != f"{PACKAGE.name}.dataclass"
        if (place := f"{path.relative_to(ROOT)}:{node.lineno}") and "dataclass" in [a.name for a in node.names]
    ]
    assert not wrong, "\n".join(wrong)


def test_no_import_circle() -> None:
    """Among the imports that Python follows when a module loads."""
    graph: dict[str, set[str]] = {module: set() for module in SOURCES}
    for found in OWN:
        if found.at_load and found.target in SOURCES and found.target != PACKAGE.name:
            graph[found.importer].add(found.target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"an import circle: {' → '.join(reversed(error.args[1]))}")


def test_a_render_imports_no_slow_library_before_it_needs_it() -> None:
    """Each costs more than the frame of a small stage."""
    slow = {"scipy", "rich", "colour", "yaml", "distributed", "PyOpenColorIO", "MaterialX"}
    code = "import sys, defshade_cli.cli, defshade_cli.rendering; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not slow & set(done.stdout.split())


def test_a_render_imports_no_module_before_it_needs_it() -> None:
    """Rooms and modules that many stages do without; each takes a quarter of a millisecond to import."""
    late = {
        *("usd.skel", "usd.nurbs", "usd.curves", "usd.subdivision", "usd.identity", "usd.models.cards"),
        *("usd.instancing.point_instancer", "usd.materials.materialx.document", "usd.opening.mask"),
        *("image.texture", "image.reading", "image.look", "image.encoders.exr", "image.false_colour"),
        *("scene.ies", "scene.motion", "scene.studio", "scene.radiance_map", "scene.triangle_tree"),
        *(
            "plan.shadow_reach",
            "passes.batch_means",
            "passes.volumes",
            "passes.debug_volumes",
            "passes.motion",
            "cli.contained",
        ),
    }
    code = "import sys, defshade_cli.cli.render, defshade_cli.rendering; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    early = {module for module in late if f"{PACKAGE.name}.{module}" in done.stdout.split()}
    assert not early, f"import these where they are needed, or for their types alone: {sorted(early)}"


@pytest.mark.parametrize("folder", ["defshade_cli", "tests"])
def test_files_stay_short(folder: str) -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / folder).rglob("*.py")}
    long = [f"{path.relative_to(ROOT)} has {count} lines" for path, count in lengths.items() if count > MAX_LINES]
    assert not long, f"over {MAX_LINES} lines, time to split: {'; '.join(long)}"
