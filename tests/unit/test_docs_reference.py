"""The reference has every command, setting, field and metric; pages load nothing from elsewhere."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import docs_alone
import docs_commands
import docs_contract
import docs_generated
import docs_schema
import pytest
from pydantic import BaseModel
from sphinx.errors import SphinxError

from rampe_guard.cli import _parser
from rampe_guard.settings.scene_model import SceneModel
from rampe_guard.settings.schema import scene_schema, site_schema
from rampe_guard.settings.site_model import SiteModel
from rampe_guard.wire.channels import KEYS
from tests.support.pages import DOCS, README, pages
from tests.support.processes import ROOT

CONTRACT = ROOT / "config" / "contract"


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from parsers(below)


def test_every_command_and_option_is_there() -> None:
    sections = {f"rampe-guard {words}": text for words, text in docs_commands.commands(_parser())}
    seen = 0
    for parser in parsers(_parser()):
        if any(isinstance(action, argparse._SubParsersAction) for action in parser._actions):
            continue
        section = sections.pop(parser.prog)
        for action in parser._actions:
            if action.dest == "help":
                continue
            for word in action.option_strings or [str(action.metavar or action.dest.upper())]:
                assert word in section, f"{parser.prog}: {word}"
                seen += 1
    assert sections == {}
    assert seen > 60
    for name in ("run", "scene put", "model reset"):
        assert f"(command-{name.replace(' ', '-')})=" in docs_commands.markdown(_parser())


def models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Every model that a type is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            for part in (field.annotation, *field.metadata):
                yield from models(part)
    for part in get_args(annotation):
        yield from models(part)


@pytest.mark.parametrize(
    ("model", "schema"), [(SiteModel, site_schema()), (SceneModel, scene_schema())]
)
def test_every_setting_is_there(model: type[BaseModel], schema: dict[str, Any]) -> None:
    blocks = docs_schema.blocks(schema)
    named = {block.name or model.__name__: block for block in blocks}
    text = docs_schema.markdown(schema, prefix="x", level=2, left_out="default")
    found = set(models(model))
    assert len(found) >= 9
    for each in found:
        for name, field in each.model_fields.items():
            key = field.alias or name
            assert key in named[each.__name__].fields, f"{each.__name__}.{key}"
            assert f"\n| `{key}` | " in text
            assert field.description, f"{each.__name__}.{key}"
    rows = sum(len(each.model_fields) for each in found)
    assert len(re.findall(r"^\| `", text, re.MULTILINE)) == rows


def test_a_block_is_told_by_its_path_and_its_bounds() -> None:
    text = docs_schema.markdown(site_schema(), prefix="site", level=2, left_out="default")
    assert "## `arm.actuators[]`" in text
    assert "(site-arm-actuators)=" in text
    assert "| `lag_s` | number ≥ 0, ≤ 5 | `0.15` | The time from command to motion [s]. |" in text
    assert "| `max_velocity` | number > 0, ≤ 1000 | **required** |" in text
    assert "[`cylinder`](#site-arm-actuators-drive-type-cylinder)" in text
    assert "(site-arm-actuators-drive-type-cylinder)=" in text


def test_every_link_within_the_generated_pages_has_its_target() -> None:
    made = "\n".join(make() for make in docs_generated.MADE.values())
    targets = re.findall(r"^\(([a-z0-9-]+)\)=$", made, re.MULTILINE)
    assert len(targets) == len(set(targets)) > 60
    assert set(re.findall(r"\]\(#([a-z0-9-]+)\)", made)) <= set(targets)


def test_every_message_field_and_key_is_there() -> None:
    text = docs_contract.messages(CONTRACT)
    for path in CONTRACT.glob("*.schema.json"):
        name = path.name.removesuffix(".schema.json")
        section = text[text.index(f"\n## `{name}`\n") :]
        for field in json.loads(path.read_text("utf-8")).get("properties", {}):
            assert f"\n| `{field}` | " in section, f"{name}.{field}"
    keys = docs_contract.keys()
    assert all(f"| `{key.address}` | {key.way} |" in keys for key in KEYS)


def test_every_metric_that_rules_and_dashboard_use_is_there() -> None:
    text = docs_generated.filled("<!-- generated: metrics -->")
    for user in ("prometheus/rules.yaml", "grafana/dashboard.json"):
        used = set(re.findall(r"\brampe_guard_\w+", (ROOT / "deploy" / user).read_text("utf-8")))
        told = {re.sub(r"_(bucket|count|sum)$", "", name) for name in used}
        assert told
        missing = {name for name in told if f"| `{name}` |" not in text}
        assert missing == set(), user


def test_marks_are_filled_and_wrong_ones_end_the_build() -> None:
    assert docs_generated.filled("before\n<!-- generated: keys -->\nafter").startswith("before\n| ")
    with pytest.raises(SphinxError, match="there are commands, site"):
        docs_generated.filled("<!-- generated: nonsense -->")
    marks = "\n".join(page.read_text("utf-8") for page in pages())
    assert {f"<!-- generated: {name} -->" in marks for name in docs_generated.MADE} == {True}


@pytest.mark.parametrize(
    "text",
    [
        '<script defer src="https://cdn.example/x.js"></script>',
        "<img alt='a' src='//cdn.example/x.png'>",
        '<link rel="stylesheet" type="text/css" href="http://cdn.example/x.css">',
        "body { background: url(https://cdn.example/x.png) }",
        '@import "https://cdn.example/x.css";',
    ],
)
def test_what_loads_from_elsewhere_is_found(text: str) -> None:
    (url,) = docs_alone.loaded(f"<p>{text}</p>")
    assert "cdn.example/x." in url


def test_what_is_here_or_only_linked_is_not() -> None:
    text = '<a href="https://mcap.dev">MCAP</a><script src="_static/x.js"></script>'
    text += '<link rel="next" href="https://x.example/"><img src="a.png">'
    assert docs_alone.loaded(text) == []


@pytest.mark.parametrize("page", pages(), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_the_readme_leads_to_every_how_to() -> None:
    text = README.read_text("utf-8")
    how_to = [p for p in (DOCS / "howto").glob("*.md") if p.stem not in {"index", "deploy"}]
    assert len(how_to) >= 10
    assert [p.stem for p in how_to if f"(deploy/docs/howto/{p.name})" not in text] == []
