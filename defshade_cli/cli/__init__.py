"""The command line: the only package that speaks click and rich.

    options    what commands share, and the RenderJob it becomes
    render gbuffer batch inspect bench compare view doctor    one command each
    progress   the ways of telling how far a job is    stats    the record that --stats writes
    jobfile tally table    what batch reads, counts and shows    terminal    what view asks the terminal
    reference  docs/commands.md, from the commands themselves

A command builds a job, calls one function and prints: results to stdout; progress, logs and errors to stderr.
A command is imported when it is called for, and a driver or a foreign library by the command that needs it.
"""

from __future__ import annotations

import atexit
import gc
import os
import sys
from importlib import import_module

import click

from defshade_cli import __version__
from defshade_cli.errors import DefshadeError, OutputError, UsageError

INTERRUPTED = 130  # 128 + SIGINT, as shells have it

COMMANDS = ("render", "gbuffer", "batch", "inspect", "bench", "compare", "view", "doctor")

_HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
_CODES = """\b
Exit codes: 0 done, 1 compare over the threshold, 2 usage, 3 the stage, 4 the GPU, 5 a file,
6 some frames of a batch failed, 130 interrupted, 143 terminated."""


def command_of(name: str) -> click.Command:
    """One of COMMANDS, from the module of its name."""
    command: click.Command = getattr(import_module(f"{__name__}.{name}"), name)
    return command


class _Group(click.Group):
    """Imports none of its commands but the one that is called for."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name in COMMANDS:
            return command_of(name)
        import difflib

        if close := difflib.get_close_matches(name, COMMANDS, 1):
            context.fail(f"no command named '{name}'; did you mean '{close[0]}'?")
        return None


@click.group(cls=_Group, context_settings=_HELP, epilog=_CODES, invoke_without_command=True)
@click.version_option(__version__, prog_name="defshade")
@click.pass_context
def defshade(context: click.Context) -> None:
    """Headless, deferred batch renderer for USD stages.

    `defshade COMMAND --help` has the options of a command and examples.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help(), err=True)
        context.exit(UsageError.exit_code)


def process() -> None:
    """`main` as all that a process is for: what is written is closed, and the rest ends with the process.

    To take USD, Mesa and the interpreter down piece by piece takes as long as to write a picture.
    """
    try:
        main()
    except SystemExit as ending:
        if not (ending.code is None or isinstance(ending.code, int)):
            raise
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(ending.code or 0)


def main() -> None:
    """Run the program and leave with its exit code: an error is one sentence on stderr, a bug a traceback."""
    _spare_the_processor()
    try:
        status = defshade.main(prog_name="defshade", standalone_mode=False)
        sys.stdout.flush()
    except click.Abort:
        _leave("interrupted", INTERRUPTED)
    except click.ClickException as error:
        _leave(_sentence(error), error.exit_code)
    except DefshadeError as error:
        _leave(str(error), error.exit_code)
    except OSError as error:
        if error.filename is not None:
            raise
        _leave(f"what is told cannot be written: {error.strerror}", OutputError.exit_code)
    sys.exit(status)


def _spare_the_processor() -> None:
    """Before libraries are loaded: no threads that wait for NumPy's matrices in loops, and fewer searches for cycles.

    Matrices here are small, and most objects of a start stay.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(20_000, 20, 20)


def _sentence(error: click.ClickException) -> str:
    """click's message, and where the help is."""
    context = getattr(error, "ctx", None)
    hint = f" (see '{context.command_path} --help')" if context else ""
    return " ".join(error.format_message().rstrip(".").split()) + hint


def _leave(message: str, status: int) -> None:
    click.echo(f"defshade: error: {message}", err=True)
    sys.exit(status)
