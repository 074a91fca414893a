"""A .mtlx file as a USD layer: the prims that OpenUSD's MaterialX plugin makes of it.

/MaterialX/Materials/<material> holds the surface shader and all nodes and node graphs that feed it. Files are named
by what they resolve to, since the layer has no place of its own.
"""

from __future__ import annotations

from pathlib import PurePosixPath
from posixpath import normpath
from typing import TYPE_CHECKING, Any

from pxr import Ar, Sdf, Tf, UsdShade

if TYPE_CHECKING:
    import MaterialX as mx

ROOT = Sdf.Path("/MaterialX")

_TYPES = {
    "float": "float",
    "integer": "int",
    "boolean": "bool",
    "string": "string",
    "filename": "asset",
    "color3": "color3f",
    "color4": "color4f",
    "vector2": "float2",
    "vector3": "float3",
    "vector4": "float4",
}
"""MaterialX types → USD's; all others are tokens, which only carry connections."""

_SURFACE = "surfaceshader"
_SOURCE = "materialx"


class NotADocument(Exception):
    """A file that MaterialX cannot read; its text says why."""


def read_document(resolved: str) -> mx.Document:
    """The document at a resolved path, on disk or in a package. Raises NotADocument; ImportError without MaterialX."""
    import MaterialX as mx

    document = mx.createDocument()
    try:
        if Ar.IsPackageRelativePath(resolved):
            asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
            mx.readFromXmlString(document, bytes(asset.GetBuffer()).decode() if asset else "")
        else:
            mx.readFromXmlFile(document, resolved)
    except (mx.ExceptionParseError, mx.ExceptionFileMissing, mx.Exception, UnicodeDecodeError) as error:
        raise NotADocument(" ".join(str(error).split())) from error
    return document


def layer_of(document: mx.Document, resolved: str) -> Sdf.Layer:
    """The document's materials in an anonymous layer; `resolved` is where it was read from."""
    layer = Sdf.Layer.CreateAnonymous("materialx.usda")
    with Sdf.ChangeBlock():
        _define(layer, ROOT, "Scope")
        materials = ROOT.AppendChild("Materials")
        _define(layer, materials, "Scope")
        for node in document.getMaterialNodes():
            _Writer(layer, document, resolved, materials.AppendChild(_name(node))).write(node)
    layer.defaultPrim = ROOT.name
    layer.customLayerData = {_SOURCE: resolved}
    return layer


def source_of(identifier: str) -> str:
    """Where the document was read from that became the anonymous layer of that name; empty for any other name."""
    layer = Sdf.Layer.Find(identifier) if Sdf.Layer.IsAnonymousLayerIdentifier(identifier) else None
    return str(layer.customLayerData.get(_SOURCE, "")) if layer else ""


def named_files(document: mx.Document, resolved: str) -> list[str]:
    """Paths of the images that a document names, tile by tile, and of the documents that it includes."""
    inputs = (element for element in document.traverseTree() if element.getCategory() == "input")
    images = [_file(i, resolved) for i in inputs if i.getType() == "filename" and i.getValueString()]
    tiles = [tile for image in images for tile in _tiles(image)]
    return [*tiles, *(_anchored(uri, resolved) for uri in document.getReferencedSourceUris())]


class _Writer:
    """Writes what one material is made of below its prim, each node once."""

    def __init__(self, layer: Sdf.Layer, document: mx.Document, resolved: str, root: Sdf.Path) -> None:
        self._layer, self._document, self._resolved, self._root = layer, document, resolved, root
        self._written: set[Sdf.Path] = set()
        self._expanding: list[str] = []

    def write(self, material: mx.Node) -> None:
        _define(self._layer, self._root, "Material")
        shader = material.getConnectedNode(_SURFACE)
        if shader is not None:
            target = self._node(shader, self._root).AppendProperty("outputs:surface")
            self._connect(self._output(self._root, "mtlx:surface", _SURFACE), target)

    def _node(self, node: mx.Node, parent: Sdf.Path) -> Sdf.Path:
        """The prim of a node, with all that feeds it."""
        path = parent.AppendChild(_name(node))
        if path in self._written:
            return path
        self._written.add(path)
        graph = _implementing(node)
        if graph and graph.getName() not in self._expanding:  # a graph inside itself has no end
            return self._expand(node, graph, path, parent)
        prim = _define(self._layer, path, "Shader")
        surface = node.getType() == _SURFACE
        identifier = Sdf.AttributeSpec(prim, "info:id", Sdf.ValueTypeNames.Token, Sdf.VariabilityUniform)
        identifier.default = f"ND_{node.getCategory()}_{node.getType()}"
        for found in node.getInputs():
            self._input(found, path, parent)
        for name, kind in _outputs(node).items():
            self._output(path, "surface" if surface else name, kind)
        return path

    def _expand(self, node: mx.Node, graph: mx.NodeGraph, path: Sdf.Path, parent: Sdf.Path) -> Sdf.Path:
        """A node that a graph of the document defines, as that graph with the node's inputs for its interface."""
        _define(self._layer, path, "NodeGraph")
        for found in (*node.getNodeDef().getActiveInputs(), *node.getInputs()):
            self._input(found, path, parent)
        self._expanding.append(graph.getName())
        expanded = self._with_outputs(graph, path)
        self._expanding.pop()
        return expanded

    def _input(self, found: mx.Input, path: Sdf.Path, parent: Sdf.Path) -> None:
        attribute = _attribute(self._layer.GetPrimAtPath(path), f"inputs:{found.getName()}", found.getType())
        source = self._source(found, parent)
        if source is not None:
            self._connect(attribute, source)
            return
        attribute.default = self._value(found)
        space = found.getActiveColorSpace()
        if space and _is_color(found):
            attribute.SetInfo("colorSpace", space)

    def _source(self, found: mx.Input | mx.Output, parent: Sdf.Path) -> Sdf.Path | None:
        """What feeds an input or the output of a graph: the graph's own interface, another graph, or a node."""
        if interface := found.getAttribute("interfacename"):
            return parent.AppendProperty(f"inputs:{interface}")
        if graph := self._document.getNodeGraph(found.getAttribute("nodegraph")):
            output = found.getOutputString() or _first_output(graph)
            return self._graph(graph).AppendProperty(f"outputs:{output}")
        node = found.getConnectedNode()
        if node is None:
            return None
        output = "surface" if node.getType() == _SURFACE else found.getOutputString() or next(iter(_outputs(node)))
        return self._node(node, parent).AppendProperty(f"outputs:{output}")

    def _graph(self, graph: mx.NodeGraph) -> Sdf.Path:
        path = self._root.AppendChild(_name(graph))
        if path in self._written:
            return path
        self._written.add(path)
        _define(self._layer, path, "NodeGraph")
        for found in graph.getInputs():
            self._input(found, path, self._root)
        return self._with_outputs(graph, path)

    def _with_outputs(self, graph: mx.NodeGraph, path: Sdf.Path) -> Sdf.Path:
        for output in graph.getOutputs():
            source = self._source(output, path)
            kind = output.getType()
            attribute = self._output(path, "surface" if kind == _SURFACE else output.getName(), kind)
            if source is not None:
                self._connect(attribute, source)
        return path

    def _output(self, path: Sdf.Path, name: str, kind: str) -> Sdf.AttributeSpec:
        return _attribute(self._layer.GetPrimAtPath(path), f"outputs:{name}", kind)

    def _connect(self, attribute: Sdf.AttributeSpec, source: Sdf.Path) -> None:
        attribute.connectionPathList.explicitItems = [source]

    def _value(self, found: mx.Input) -> Any:
        if found.getType() == "filename":
            return Sdf.AssetPath(_file(found, self._resolved)) if found.getValueString() else None
        value = found.getValue()
        return tuple(value.asTuple()) if hasattr(value, "asTuple") else value


def _define(layer: Sdf.Layer, path: Sdf.Path, type_name: str) -> Sdf.PrimSpec:
    prim = Sdf.CreatePrimInLayer(layer, path)
    prim.specifier, prim.typeName = Sdf.SpecifierDef, type_name
    return prim


def _attribute(prim: Sdf.PrimSpec, name: str, kind: str) -> Sdf.AttributeSpec:
    existing = prim.attributes.get(name)
    return existing or Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Find(_TYPES.get(kind, "token")))


def _name(element: mx.Element) -> str:
    return str(Tf.MakeValidIdentifier(element.getName()))


def _implementing(node: mx.Node) -> mx.NodeGraph | None:
    """The graph of the document that defines a node, if one does: MaterialX's own library is not read."""
    definition = node.getNodeDef()
    implementation = definition.getImplementation() if definition else None
    return implementation if implementation and implementation.getCategory() == "nodegraph" else None


def _outputs(node: mx.Node) -> dict[str, str]:
    """Output names and types. Of a node with several the document states none but those that are connected."""
    if node.getType() != "multioutput":
        return {"out": node.getType()}
    ports = {port.getOutputString(): port.getType() for port in node.getDownstreamPorts()}
    return {name: kind for name, kind in ports.items() if name} or {"out": "float"}


def _first_output(graph: mx.NodeGraph) -> str:
    return next((output.getName() for output in graph.getOutputs()), "out")


def _is_color(found: mx.Input) -> bool:
    """Has the value, or the image of a file, colours that a colour space is meant for?"""
    parent = found.getParent()
    kind = parent.getType() if found.getType() == "filename" and hasattr(parent, "getType") else found.getType()
    return kind.startswith("color") or found.hasColorSpace()


def _file(found: mx.Input, resolved: str) -> str:
    """With the file prefixes around it; without them where only that exists, as OpenUSD's plugin reads it."""
    prefixed, plain = (_anchored(name, resolved) for name in (found.getResolvedValueString(), found.getValueString()))
    return plain if prefixed != plain and not Ar.GetResolver().Resolve(prefixed) else prefixed


def _tiles(image: str) -> list[str]:
    if not UsdShade.UdimUtils.IsUdimIdentifier(image):
        return [image]
    return [path for path, _ in UsdShade.UdimUtils.ResolveUdimTilePaths(image, Sdf.Layer.CreateAnonymous())]


def _anchored(name: str, resolved: str) -> str:
    """A path from the document on; Ar knows none inside packages, where it is in the document's own."""
    name = name.replace("\\", "/")
    if not Ar.IsPackageRelativePath(resolved) or PurePosixPath(name).is_absolute():
        return str(Ar.GetResolver().CreateIdentifier(name, Ar.ResolvedPath(resolved)))
    package, document = Ar.SplitPackageRelativePathInner(resolved)
    return str(Ar.JoinPackageRelativePath(package, normpath(PurePosixPath(document).parent / name)))
