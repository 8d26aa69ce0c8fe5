"""``rampe-guard model``: what is kept of an operator's way of working; show, export, forget."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from rampe_guard.collision import load_arm
from rampe_guard.core.intention import Intention
from rampe_guard.core.rampe import CategoryRow
from rampe_guard.core.types import Category, FloatArray
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.store import (
    SUFFIX,
    ModelFile,
    model_folder,
    model_path,
    situations_file,
)
from rampe_guard.runtime.store_format import (
    Arrays,
    Header,
    decode,
    header_of,
    misfit,
    situations_header,
)
from rampe_guard.runtime.store_keeper import recall
from rampe_guard.runtime.store_situations import decode_situations
from rampe_guard.settings import Site, for_operator, load_site

_MOST_NAMED = 20
_REMEMBERED = "{path}: {why}; a guard would set this file aside and remember nothing"
_SIGN = {-1: "-", 1: "+"}


@dataclass(frozen=True, slots=True)
class _Model:
    """A kept model, read and understood."""

    path: Path
    size: int
    header: Header
    arrays: Arrays
    rows: tuple[CategoryRow, ...]
    situations: _Situations | None


@dataclass(frozen=True, slots=True)
class _Situations:
    """The kept situations beside it."""

    path: Path
    size: int
    count: int
    hours: float


def show_model(site_path: str, operator: str | None, console: Console) -> int:
    """Print what is kept, as a person reads it.

    Raises:
        ModelFileError: nothing is kept, or it cannot be used.
    """
    model = _load(for_operator(load_site(site_path), operator))
    header = model.header
    saved = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(header.saved_unix_s))
    refused = ", ".join(f"{count} {reason}" for reason, count in header.refused.items() if count)
    facts = Table(box=None, show_header=False, pad_edge=False)
    facts.add_column(style="dim", no_wrap=True)
    facts.add_column(overflow="fold")
    for name, value in (
        ("operator", header.operator),
        ("machine", f"{header.machine} at {header.site}"),
        ("learned", f"{header.occurrences} primitives of {header.categories} categories"),
        ("not learned", refused or "none"),
        ("saved", f"{saved} by rampe-guard {header.version}"),
        ("file", str(model.path)),
        ("size", f"{model.size:,} bytes, {header.format}"),
        ("situations", _situations_text(model.situations)),
    ):
        facts.add_row(name, Text(value))
    console.print(facts)
    console.print()
    console.print(_table(model))
    console.print()
    console.print(Text("mean and spread: of the newest occurrences, which are remembered", "dim"))
    return 0


def export_model(site_path: str, operator: str | None) -> bytes:
    """What is kept as one JSON document; values that are not finite are null.

    Raises:
        ModelFileError: nothing is kept, or it cannot be used.
    """
    model = _load(for_operator(load_site(site_path), operator))
    names = [actuator.name for actuator in model.header.actuators]
    return msgspec.json.encode(
        {
            "header": model.header,
            "categories": [
                {
                    "category": row.category,
                    "occurrences": row.occurrences,
                    "mean_displacement": dict(
                        zip(names, row.mean_displacement.tolist(), strict=True)
                    ),
                    "spread": dict(zip(names, row.spread.tolist(), strict=True)),
                }
                for row in model.rows
            ],
            "situations": None
            if model.situations is None
            else {
                "count": model.situations.count,
                "work_s": model.situations.hours * 3600.0,
                "file": str(model.situations.path),
            },
            "arrays": {
                name: {"dtype": array.dtype.str, "shape": array.shape, "values": array.tolist()}
                for name, array in model.arrays.items()
            },
        }
    )


def reset_model(site_path: str, operator: str | None, console: Console, *, sure: bool) -> int:
    """Delete what is kept of an operator on this machine, for good.

    Args:
        site_path: the site file.
        operator: whom to forget, instead of whom the site file names.
        console: where it says what it did.
        sure: nobody at a terminal needs to be asked.

    Raises:
        ModelFileError: a running guard would save it again, or it cannot be deleted.
    """
    site = for_operator(load_site(site_path), operator)
    path = model_path(site)
    who = f"operator {site.operator!r} on {site.machine} at {site.name}"
    file, remembered = ModelFile(path), situations_file(path)
    if path.parent.is_dir():
        with file, remembered:
            models = [*file.all_models(), *remembered.all_models()]
            if models and not sure and sys.stdin.isatty():
                raise ModelFileError(
                    f"this forgets all that was learned of {who} ({_listed(models)});"
                    " give --yes to do it"
                )
            if [*file.delete(), *remembered.delete()]:
                console.print(Text(f"forgotten: {who}; deleted {_listed(models)}"))
                return 0
    console.print(Text(f"nothing is kept of {who}: there is no {path}"))
    return 0


def _load(site: Site) -> _Model:
    path = model_path(site)
    limits = load_arm(site.arm).limits
    rampe = Intention(site.guard, limits).rampe
    try:
        content = ModelFile(path).read()
    except ModelFileError as error:
        raise ModelFileError(f"{path}: {error}") from None
    if content is None:
        others = ", ".join(map(repr, _operators(site)))
        raise ModelFileError(
            f"nothing is kept of operator {site.operator!r} yet: there is no {path}"
            + (f"; kept here: {others}" if others else "")
            + "; a guard under systemd keeps its models in its $STATE_DIRECTORY"
        )
    try:
        recall(content, header_of(site, limits), rampe)
    except ModelFileError as error:
        raise ModelFileError(
            f"{path}: {error}; a guard would set this file aside and start with nothing learned"
        ) from None
    found = _situations(site, limits, path)
    return _Model(path, len(content), *decode(content), tuple(rampe.table()), found)


def _situations(site: Site, limits: FloatArray, model: Path) -> _Situations | None:
    """What is kept beside a model; None if there is nothing."""
    file = situations_file(model)
    try:
        content = file.read()
        if content is None:
            return None
        header, arrays = decode_situations(content)
    except ModelFileError as error:
        raise ModelFileError(_REMEMBERED.format(path=file.path, why=error)) from None
    if reason := misfit(header, situations_header(site, limits)):
        raise ModelFileError(_REMEMBERED.format(path=file.path, why=reason))
    clock = arrays["next_clock"]
    hours = float(clock[-1] - clock[0]) / 3600.0 if len(clock) else 0.0
    return _Situations(file.path, len(content), header.occurrences, hours)


def _situations_text(found: _Situations | None) -> str:
    if found is None:
        return "none"
    return f"{found.count:,} of {found.hours:.1f} h of work, {found.size:,} bytes in {found.path}"


def _operators(site: Site) -> list[str]:
    """Of whom there is a model of this machine."""
    found = []
    models = (p for p in model_folder(site).glob(f"*{SUFFIX}") if "." not in p.stem)
    for path in sorted(models)[:_MOST_NAMED]:
        with contextlib.suppress(ModelFileError):
            content = ModelFile(path).read()
            if content is not None:
                found.append(decode(content)[0].operator)
    return found


def _table(model: _Model) -> Table:
    """A line for each actuator that a category moves; the most frequent categories first."""
    table = Table(box=None, pad_edge=False)
    for name, how in (
        *(("category", "left"), ("occurrences", "right"), ("moves", "left")),
        *(("mean", "right"), ("spread", "right"), ("", "left")),
    ):
        right = how == "right"
        table.add_column(name, header_style="dim", justify="right" if right else "left")
    actuators = model.header.actuators
    for row in sorted(model.rows, key=lambda row: (-row.occurrences, row.category)):
        first = [_signs(row.category, [a.name for a in actuators]), str(row.occurrences)]
        for j in np.flatnonzero(row.category).tolist():
            mean, spread = (float(v[j]) for v in (row.mean_displacement, row.spread))
            table.add_row(
                *map(Text, first),
                Text(actuators[j].name),
                f"{mean:+.3f}",
                f"{spread:.3f}" if np.isfinite(spread) else "-",
                actuators[j].unit,
            )
            first = ["", ""]
    return table


def _signs(category: Category, names: list[str]) -> str:
    moved = [f"{name}{_SIGN[sign]}" for name, sign in zip(names, category, strict=True) if sign]
    return " ".join(moved)


def _listed(paths: list[Path]) -> str:
    return ", ".join(map(str, paths))
