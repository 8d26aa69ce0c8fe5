"""What deploy/ and the README hand to a site works with the Zenoh version that we lock."""

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
import zenoh

from rampe_guard.resources import data_dir
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import ZenohSettings
from tests.support.processes import free_endpoint

pytestmark = pytest.mark.e2e
README = Path(__file__).parents[2] / "README.md"


def test_the_router_configuration_routes() -> None:
    config = zenoh.Config.from_file(data_dir() / "deploy" / "router.json5")
    assert json.loads(config.get_json("listen/endpoints")) == ["tcp/127.0.0.1:7447"]
    endpoint = free_endpoint()
    config.insert_json5("listen/endpoints", json.dumps([endpoint]))
    router = zenoh.open(config)
    try:
        with Bus.open(ZenohSettings(None, "client", (endpoint,))) as bus:
            assert bus.connected
            inbox, outbox = bus.inbox("a/b"), bus.outbox("a/b")
            outbox.put(b"{}")
            for _ in range(200):
                if messages := inbox.drain():
                    break
                time.sleep(0.01)
            assert [m.payload for m in messages] == [b"{}"]
    finally:
        router.close()


def test_the_readme_s_sweep_examples_say_what_they_show() -> None:
    text = README.read_text()
    shell = re.search(r"echo '(\{.*?\})' \| rampe-guard sweep (\S+)", text)
    assert shell is not None
    lines, site = shell.groups()
    command = [sys.executable, "-m", "rampe_guard", "sweep", str(data_dir() / site)]
    out = subprocess.run(command, input=lines.encode(), capture_output=True, check=True).stdout
    reply = json.loads(out)
    snippets = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (snippet,) = (code for code in snippets if "rg.Sweeper(" in code)
    code = snippet.replace("config/sites", str(data_dir() / "config/sites"))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert run.stdout.split() == [
        reply["certificate"],
        reply["zone"],
        str(reply["contact_fraction"]),
    ]
    assert reply["certificate"] == "contact"
    assert reply["zone"] == "wall"
