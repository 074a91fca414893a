"""Every failure that a user can meet, as one tree; each maps to an exit code.

    DefshadeError
    ├── UsageError        2   an argument that cannot be honoured
    ├── StageError        3   the stage, or a prim in it
    │   ├── StageNotFound     the file is missing or is not USD
    │   ├── PrimNotFound      a camera, settings or mask path that the stage lacks
    │   └── EmptyStage        nothing to draw
    ├── GpuError          4   no context, a driver limit, out of memory
    │   └── ShaderError       a shader that does not compile, as file:line
    ├── OutputError       5   a file that cannot be written or read back
    │   └── UnsoundImage      it is written, and holds values that are no numbers
    └── BatchError        6   some frames of a batch failed

A bug asserts; a failure at run time raises one of these; an expected outcome is a return value.
The command line prints `str(error)`, one sentence, and ends with `error.exit_code`.
"""

from __future__ import annotations


class DefshadeError(Exception):
    """Base of every error this package raises on purpose."""

    exit_code = 1


class UsageError(DefshadeError):
    exit_code = 2


class StageError(DefshadeError):
    exit_code = 3


class StageNotFound(StageError):
    pass


class PrimNotFound(StageError):
    pass


class EmptyStage(StageError):
    pass


class GpuError(DefshadeError):
    exit_code = 4


class ShaderError(GpuError):
    pass


class OutputError(DefshadeError):
    exit_code = 5


class UnsoundImage(OutputError):
    pass


class BatchError(DefshadeError):
    exit_code = 6
