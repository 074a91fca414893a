"""UsdRenderVars as layers: which layer answers a variable."""

from __future__ import annotations

import re

from defshade_cli.errors import UsageError
from defshade_cli.image.layers.names import resolve
from defshade_cli.scene.product import Variable

_EXPRESSIONS: dict[str, str] = {
    "C.*": "beauty",
    "C[LO]": "beauty",
    "C.*[LO]": "beauty",
    "C<.D>L": "diffuse",
    "C<RD>L": "diffuse",
    "C<.D>[LO]": "diffuse",
    "C<RD>[LO]": "diffuse",
    "C<.[SG]>L": "specular",
    "C<.[SG]>[LO]": "specular",
    "C<R[SG]>L": "specular",
    "C<RS>L": "specular",
    "C<RG>L": "specular",
    "CO": "emission",
}
"""Light path expressions (OSL's language) that light without bounces can answer, without spaces."""

_OF_GROUP = re.compile(r"C(?:\.\*|<\.\*>|<R[DSG.]>)*<?L\.?'(?P<group>[^']+)'>?")


def layer_of(variable: Variable) -> str | None:
    """The layer that answers `variable`; None where none does."""
    try:
        return resolve([_wanted(variable)])[0]
    except UsageError:
        return None


def _wanted(variable: Variable) -> str:
    if variable.source_type == "primvar":
        return f"primvars:{variable.source.removeprefix('primvars:')}"
    if variable.source_type == "lpe":
        expression = re.sub(r"\s", "", variable.source).removeprefix("lpe:")
        group = _OF_GROUP.fullmatch(expression)
        return f"light:{group['group']}" if group else _EXPRESSIONS.get(expression, expression)
    return variable.source
