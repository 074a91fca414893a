"""A worker process: `python -m defshade_cli.farm.worker FD`, started by farm.local.

It reads Chunks from the connection FD and answers with an Outcome a frame, until the connection closes. Its stdout and
stderr are the log. An error of the stage or the output is an outcome; a bug or a crash ends the process, which the
other end notices.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from multiprocessing.connection import Connection

from defshade_cli.errors import DefshadeError, GpuError
from defshade_cli.farm.limits import build_wall
from defshade_cli.farm.tasks import Chunk, Outcome, failed, joined
from defshade_cli.rendering import Renderer, run


def serve(connection: Connection, command: str) -> None:
    """Render what comes until nothing more can come. `command` goes into the files' headers."""
    with Renderer() as renderer:
        while True:
            try:
                chunk = connection.recv()
            except EOFError:
                return
            for outcome in render_chunk(chunk, renderer, command):
                connection.send(outcome)


def render_chunk(chunk: Chunk, renderer: Renderer, command: str) -> Iterator[Outcome]:
    """An outcome for each frame, in order; after one that failed the rest is begun anew."""
    pending = chunk.split()
    while pending:
        try:
            for result in run(joined(pending).job, command=command, renderer=renderer):
                task = pending.pop(0)
                yield Outcome(task, result.frame, result.paths, result.skipped, result.seconds)
        except DefshadeError as error:
            yield failed(pending.pop(0), str(error), error.exit_code)
            if isinstance(error, GpuError):
                renderer.close()
        except MemoryError:
            yield failed(pending.pop(0), "there is not as much memory as it takes")
            renderer.close()


def main() -> None:
    """Serve the parent on a connection that it left open; the arguments: its descriptor, command, log level, bytes."""
    descriptor, command, level, memory = sys.argv[1:]
    logging.basicConfig(format="defshade: %(message)s", level=logging.WARNING)
    logging.getLogger("defshade").setLevel(level)
    if int(memory):
        build_wall(int(memory))
    serve(Connection(int(descriptor)), command)


if __name__ == "__main__":
    main()
