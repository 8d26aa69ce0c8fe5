"""A recorded stretch of work gives the alerts that it gave before, in the same order.

`quarry.csv` is four cycles of the demo's simulated operator, one of which swings too far.
When a change of behaviour is meant, look at what differs, then write the file anew:
``python tests/replay/test_golden.py``.
"""

import json
from pathlib import Path

import pytest

from rampe_guard.errors import InterruptedReplayError
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.resources import shipped_site
from rampe_guard.runtime.stopping import StopFlag

HERE = Path(__file__).parent
LOG, GOLDEN = HERE / "quarry.csv", HERE / "quarry.alerts.json"


def alerts() -> list[bytes]:
    return list(replay_offline(str(shipped_site("demo")), str(LOG), StopFlag(), repeats=True))


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


def test_replay_gives_the_golden_alerts_and_the_same_bytes_twice() -> None:
    first, second = alerts(), alerts()
    assert first == second
    assert told(first) == json.loads(GOLDEN.read_text())


def test_the_golden_run_is_worth_its_name() -> None:
    golden = json.loads(GOLDEN.read_text())
    levels = {row[2] for row in golden if row[1] == "wall"}
    assert {"clear", "imminent"} <= levels


def test_an_interrupted_replay_has_no_score(capsys: pytest.CaptureFixture[str]) -> None:
    stop = StopFlag()
    stop.set()
    with pytest.raises(InterruptedReplayError):
        list(replay_offline(str(shipped_site("demo")), str(LOG), stop, repeats=False))
    assert "contacts" not in capsys.readouterr().err  # meshes being wrapped may be told


if __name__ == "__main__":
    lines = ",\n".join(json.dumps(row) for row in told(alerts()))
    GOLDEN.write_text(f"[\n{lines}\n]\n")
