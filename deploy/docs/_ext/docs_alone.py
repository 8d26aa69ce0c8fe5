"""A page that loads anything from elsewhere ends the build: pages are read without internet."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import SphinxError

_LOADS = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc=["'](?P<src>(?:https?:)?//[^"']+)"""
    r"""|<link\b(?=[^>]*\brel=["'](?:stylesheet|preload|prefetch|icon|shortcut icon)["'])"""
    r"""[^>]*\bhref=["'](?P<href>(?:https?:)?//[^"']+)"""
    r"""|(?:url\(|@import\s+)["']?(?P<css>(?:https?:)?//[^"')]+)"""
)


def setup(app: Sphinx) -> dict[str, bool]:
    """Look at everything once it is written."""
    app.connect("build-finished", _look)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def loaded(text: str) -> list[str]:
    """Addresses elsewhere that a browser would load to show this page or style sheet."""
    return [found[found.lastgroup or 0] for found in _LOADS.finditer(text)]


def _look(app: Sphinx, failure: Exception | None) -> None:
    if failure is not None or app.builder.format != "html":
        return
    files = (p for p in Path(app.outdir).rglob("*") if p.suffix in {".html", ".css"})
    found = [f"{path}: {url}" for path in files for url in loaded(path.read_text("utf-8"))]
    if found:
        raise SphinxError("pages load from elsewhere:\n" + "\n".join(found))
