"""Sections of a page that are generated: between `<!-- generated: NAME -->` and `<!-- end generated -->`."""

from __future__ import annotations

import re


def generated(page: str, name: str) -> str:
    """What the section holds. Raises ValueError where the page has no such section."""
    return _find(page, name)[2]


def replace_generated(page: str, name: str, content: str) -> str:
    """`page` with `content` in the section. Raises ValueError where it has no such section."""
    found = _find(page, name)
    return f"{page[: found.start(2)]}{content}\n{page[found.end(2) :]}"


def _find(page: str, name: str) -> re.Match[str]:
    section = re.compile(rf"(<!-- generated: {re.escape(name)} -->\n)(.*?)<!-- end generated -->", re.DOTALL)
    if found := section.search(page):
        return found
    raise ValueError(f"no section generated: {name}")
