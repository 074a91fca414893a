"""Fixtures that every test file may ask for."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from defshade_cli import resources

if TYPE_CHECKING:
    from defshade_cli.gpu.context import Gpu

settings.register_profile("steady", deadline=None)  # a busy machine is no fault of an example's
settings.load_profile("steady")

if "PYTEST_XDIST_WORKER" in os.environ:  # each core has tests of its own to draw for
    os.environ.setdefault("LP_NUM_THREADS", "1")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in a shell's background, which children inherit
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parent.parent

RENDERERS = {"CliRunner", "Renderer", "render", "run", "subprocess"}
"""Names that a test file imports when it renders frames or starts processes."""


def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Mark what takes most of the time, which `make check` leaves to `make test`."""
    for item in items:
        if "gpu" in item.fixturenames or RENDERERS & vars(item.module).keys():
            item.add_marker("renders")


@pytest.fixture(scope="session")
def assets() -> Path:
    """Folder of stages by others; the tests that read them are skipped where there is none."""
    folder = Path(os.environ.get("DEFSHADE_ASSETS", ROOT.parent / "shared" / "assets"))
    if not folder.is_dir():
        pytest.skip("no folder of stages by others: set DEFSHADE_ASSETS")
    return folder


@pytest.fixture(scope="session")
def scenes() -> Path:
    """Folder of this project's own stages."""
    return resources.SCENES


@pytest.fixture(scope="session")
def gpu() -> Iterator[Gpu]:
    """One GL context for the whole run."""
    from defshade_cli.gpu.context import Gpu

    with Gpu() as gpu:
        yield gpu


@pytest.fixture(autouse=True)
def _log_as_before() -> Iterator[None]:
    """A command that runs in this process sets up the log; the next test finds it untouched."""
    logger = logging.getLogger("defshade")
    level, handlers = logger.level, logger.handlers
    yield
    logger.setLevel(level)
    logger.handlers = handlers
