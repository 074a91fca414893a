"""Why something of a stage cannot be read: values that are damaged, or of other types than their schemas have.

Readers take values to be what their schemas say. Where one is not, what then fails is looked into here: the stage is
named if it is to blame, and any other failure goes on as the bug that it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Tf, Usd

from defshade_cli.errors import DefshadeError, StageError
from defshade_cli.usd.opening.diagnostics import commentary

_REASONS = (Tf.ErrorException, TypeError, ValueError, ArithmeticError, AttributeError, LookupError)


def blamed(error: Exception, prim: Usd.Prim) -> str:
    """Why `prim` cannot be read. Raises `error` again where neither it nor what stands below it is to blame."""
    if isinstance(error, Tf.ErrorException):
        return f"USD cannot read it: {commentary(error.args[0]).partition(chr(10))[0]}"
    if isinstance(error, _REASONS):
        for each in Usd.PrimRange(prim, Usd.TraverseInstanceProxies()):
            for lie in mistyped(each):
                return lie
    raise error


@contextmanager
def blaming(stage: Usd.Stage) -> Iterator[None]:
    """What fails in the block for the stage's own fault is a StageError."""
    try:
        yield
    except DefshadeError:
        raise
    except Exception as error:
        raise StageError(f"{stage.GetRootLayer().GetDisplayName()}: {blamed(error, stage.GetPseudoRoot())}") from error


def mistyped(prim: Usd.Prim) -> Iterator[str]:
    """The attributes that are authored with another type than the prim's schemas have, one clause each."""
    definition = prim.GetPrimDefinition()
    for attribute in prim.GetAuthoredAttributes():
        declared = definition.GetAttributeDefinition(attribute.GetName())
        kind = declared.GetTypeName() if declared else attribute.GetTypeName()
        for spec in attribute.GetPropertyStack():
            if spec.typeName != kind or not kind:
                yield f"{prim.GetPath()}.{attribute.GetName()} is not of type {kind or 'any schema'}"
                break
