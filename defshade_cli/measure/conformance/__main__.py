"""`python -m defshade_cli.measure.conformance OUT [PAGE]`: index.html and report.json in OUT, tables in a docs page."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from defshade_cli.errors import DefshadeError
from defshade_cli.measure.conformance.batch import examine_items
from defshade_cli.measure.conformance.catalogue import assets_folder, read_items
from defshade_cli.measure.conformance.page import page_of
from defshade_cli.measure.conformance.report import report_of, summary_of, tables_of
from defshade_cli.measure.conformance.results import Result
from defshade_cli.measure.sections import replace_generated

WORKERS = 2


def main(out: Path, docs: Path | None = None) -> int:
    """Examine every case; the exit code is 1 where one fails. Progress goes to stderr."""
    assets = assets_folder()
    results: list[Result] = []
    start = time.perf_counter()
    for done in examine_items(read_items(assets), assets, out / "pictures", WORKERS):
        results += done
        print(f"{done[0].item}: {len(done)} pictures", file=sys.stderr, flush=True)
    _write(results, out, docs)
    print(f"{summary_of(results)}; {time.perf_counter() - start:.0f} s", file=sys.stderr)
    for failed in (result for result in results if result.fails):
        print(f"{failed.key} {failed.stage}: {failed.error or f'IoU {failed.iou:.4f}'}", file=sys.stderr)
    return int(any(result.fails for result in results))


def _write(results: Sequence[Result], out: Path, docs: Path | None) -> None:
    (out / "report.json").write_text(json.dumps(report_of(results), indent=1), "utf-8")
    (out / "index.html").write_text(page_of(results, out / "pictures"), "utf-8")
    if docs:
        docs.write_text(replace_generated(docs.read_text("utf-8"), "conformance", tables_of(results)), "utf-8")


if __name__ == "__main__":
    try:
        sys.exit(main(*map(Path, sys.argv[1:])))
    except DefshadeError as error:
        print(f"defshade: error: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
