"""The form of report.json, and who may be asked to fill it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from rampe_guard.errors import SettingsError
from rampe_guard.evaluate.forecasters_learned import _Kernel, _mean
from rampe_guard.evaluate.report_model import report_schema
from rampe_guard.programs.contract import contract_text
from rampe_guard.programs.fleet_file import read_fleet
from tests.support.processes import ROOT


def test_the_schema_beside_the_site_files_is_current() -> None:
    text = (ROOT / "config" / "report.schema.json").read_text("utf-8")
    assert text == contract_text("report"), "run: rampe-guard schema report"
    jsonschema.Draft202012Validator.check_schema(report_schema())


def test_every_struct_and_figure_of_the_schema_is_described() -> None:
    schema: dict[str, Any] = report_schema()
    point = schema["$defs"]["Point"]
    assert set(point["required"]) == set(point["properties"])
    for name, field in point["properties"].items():
        assert json.dumps(field).count('"description"') >= 1, name
    assert {"curve", "operating_point"} <= set(schema["$defs"]["Forecast"]["required"])


def test_the_gaussian_process_is_scikit_learns() -> None:
    rng = np.random.default_rng(4)
    q, x = rng.random((17, 3)), rng.standard_normal((17, 3))
    x[:, 2] = 0.25  # an actuator that always goes as far has no scatter
    at = rng.random(3)
    for kernel in (_Kernel(), _Kernel(2.0, 0.7, 0.05)):
        fit = GaussianProcessRegressor(_sklearn(kernel), optimizer=None, normalize_y=True).fit(q, x)
        np.testing.assert_allclose(_mean(kernel, q, x, at), fit.predict(at[None])[0], atol=1e-10)


def _sklearn(kernel: _Kernel) -> Any:
    return ConstantKernel(kernel.signal) * RBF(kernel.length) + WhiteKernel(kernel.white)


def fleet(folder: Path, text: str) -> str:
    path = folder / "fleet.yaml"
    path.write_text(text, "utf-8")
    return str(path)


def test_a_fleet_lists_operators_relative_to_itself(tmp_path: Path) -> None:
    for name in ("b.csv", "a.csv", "c.mcap"):
        (tmp_path / name).touch()
    anna, ben = read_fleet(
        fleet(
            tmp_path,
            "sequences:\n"
            "  - {name: anna, site: north.yaml, logs: ['*.csv', c.mcap]}\n"
            "  - {name: ben 2, site: south.yaml, logs: [b.csv]}\n",
        )
    )
    assert anna.site == str(tmp_path / "north.yaml")
    assert [Path(log).name for log in anna.logs] == ["a.csv", "b.csv", "c.mcap"]
    assert (ben.name, ben.logs) == ("ben 2", (str(tmp_path / "b.csv"),))


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ("[{name: a, site: s, logs: [none.csv]}]", r"fleet.yaml:1: .*no file is 'none.csv'"),
        ("[{name: a, site: s, logs: ['*.csv']}]", "no file is"),
        ("[{name: ../a, site: s, logs: [x.csv]}]", "name"),
        ("[{name: a, site: s, logs: []}]", "logs"),
        ("[{name: a, site: s}]", "logs: is missing"),
        (
            "[{name: a, site: s, logs: [fleet.yaml]}, {name: a, site: s, logs: [fleet.yaml]}]",
            "twice",
        ),
        ("[]", "sequences"),
    ],
)
def test_a_fleet_that_cannot_be_is_refused_by_line(
    entries: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(SettingsError, match=words):
        read_fleet(fleet(tmp_path, f"sequences: {entries}\n"))
