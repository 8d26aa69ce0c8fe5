"""What pages take from elsewhere: ``<!-- generated: NAME -->`` in a page becomes Markdown.

Most is made from the code. Nothing of it is kept twice, so nothing of it can be out of date.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

import docs_commands
import docs_contract
import docs_metrics
import docs_schema
from sphinx.application import Sphinx
from sphinx.errors import SphinxError

from rampe_guard.cli import _parser
from rampe_guard.settings.schema import scene_schema, site_schema

_MARK: Final = re.compile(r"^<!-- generated: ([a-z]+) -->$", re.MULTILINE)
_ROOT: Final = Path(__file__).resolve().parents[3]
_CONTRACT: Final = _ROOT / "config" / "contract"
_FAULTS: Final = re.compile(r"^<!-- faults -->\n(.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)


def _settings(prefix: str, schema: Callable[[], docs_schema.Schema]) -> Callable[[], str]:
    return lambda: docs_schema.markdown(schema(), prefix=prefix, level=2, left_out="default")


def _faults() -> str:
    """The table of the README, which is the only one."""
    found = _FAULTS.search((_ROOT / "README.md").read_text("utf-8"))
    if found is None:
        raise SphinxError("README.md: no table of faults between its marks")
    return found[1]


MADE: Final[dict[str, Callable[[], str]]] = {
    "commands": lambda: docs_commands.markdown(_parser()),
    "site": _settings("site", site_schema),
    "scene": _settings("scene", scene_schema),
    "keys": docs_contract.keys,
    "messages": lambda: docs_contract.messages(_CONTRACT),
    "metrics": docs_metrics.markdown,
    "faults": _faults,
}


def filled(text: str) -> str:
    """A page with its marks replaced.

    Raises:
        SphinxError: nothing of that name is made.
    """

    def made(found: re.Match[str]) -> str:
        if found[1] not in MADE:
            raise SphinxError(f"{found[0]}: there are {', '.join(MADE)}")
        return MADE[found[1]]()

    return _MARK.sub(made, text)


def setup(app: Sphinx) -> dict[str, bool]:
    """Fill each page as it is read."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _read(app: Sphinx, page: str, content: list[str]) -> None:  # noqa: ARG001 - Sphinx calls it so
    content[0] = filled(content[0])
