"""A recorded stretch of work gives the alerts that it gave before, in the same order.

`quarry.csv` is four cycles of the demo's simulated operator, one of which swings too far.
`bench.mcap` is a recording that is replayed alone, as `tests.support.recorded_work` made it: a
cart that moves, rubbish on the keys, silence, the enable key.
When a change of behaviour is meant, look at what differs, then write the files anew:
``python tests/replay/test_golden.py``.
"""

import json
import os
from pathlib import Path

import pytest

from rampe_guard.errors import InterruptedReplayError
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.stopping import StopFlag

HERE = Path(__file__).parent
NIGHTLY = os.environ.get("RAMPE_GUARD_TESTS") == "nightly"
LOGS = {
    "quarry": (str(shipped_site("demo")), str(HERE / "quarry.csv")),
    "bench": (None, str(HERE / "bench.mcap")),
}
"""Site file, if the log does not hold it itself, and log."""
both = pytest.mark.parametrize("name", LOGS)


def golden(name: str) -> Path:
    return HERE / f"{name}.alerts.json"


def alerts(name: str) -> list[bytes]:
    site, log = LOGS[name]
    return list(replay_offline(site, log, StopFlag(), repeats=True))


def told(lines: list[bytes]) -> list[list[object]]:
    """What an operator would notice of each transition; figures rounded for other machines."""
    kept: list[list[object]] = []
    last: dict[str, tuple[str, str]] = {}
    for line in lines:
        alert = json.loads(line)
        if last.get(alert["zone"]) == (alert["level"], alert["state"]):
            continue
        last[alert["zone"]] = (alert["level"], alert["state"])
        time_s = round(alert["published_unix_s"], 2)
        fields = ("zone", "level", "state", "source", "link")
        kept.append([time_s, *(alert[f] for f in fields)])
    return kept


@pytest.mark.no_cover  # every step of long recordings
@both
def test_replay_gives_the_golden_alerts_and_the_same_bytes_twice(name: str) -> None:
    first = alerts(name)
    if name == "bench" or NIGHTLY:  # the other takes long
        assert first == alerts(name)
    assert told(first) == json.loads(golden(name).read_text())


@pytest.mark.parametrize(
    ("name", "zone", "levels"),
    [
        ("quarry", "wall", {"clear", "imminent"}),
        ("bench", "crate", {"clear", "imminent"}),
        ("bench", "cart", {"clear", "imminent"}),
        ("bench", None, {"clear", "warning"}),  # an input fell silent
    ],
)
def test_the_golden_run_is_worth_its_name(name: str, zone: str | None, levels: set[str]) -> None:
    assert levels <= {row[2] for row in json.loads(golden(name).read_text()) if row[1] == zone}


def test_an_interrupted_replay_has_no_score(capsys: pytest.CaptureFixture[str]) -> None:
    stop = StopFlag()
    stop.set()
    with pytest.raises(InterruptedReplayError):
        list(replay_offline(*LOGS["quarry"], stop, repeats=False))
    assert "contacts" not in capsys.readouterr().err  # meshes being wrapped may be told


if __name__ == "__main__":
    for each in LOGS:
        lines = ",\n".join(json.dumps(row) for row in told(alerts(each)))
        golden(each).write_text(f"[\n{lines}\n]\n")
