"""Does every message of a demo keep the contract? ``python -m tests.benchmarks.contract``.

A demo as anyone starts it is heard for ``--seconds`` (60) after its guard speaks: every message
on every key, inputs too, is held against the AsyncAPI document and the JSON Schema that it
names, and its quality of service against the document. Prints how many of each there were;
ends with 1 at the first that does not keep it.
"""

from __future__ import annotations

import argparse
import re
import signal
import sys
import tempfile
import time
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]

from rampe_guard.settings import load_site
from tests.support.processes import DEMO, Process, until
from tests.support.tap import Document, Tap


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    seconds = parser.parse_args().seconds
    keys = load_site(DEMO).keys
    parameters = {"joystick": keys.joystick, "actuators": keys.actuators, "base": keys.base}
    args = ["-m", "rampe_guard", "demo", "--cycles", "1000"]
    with tempfile.TemporaryDirectory() as folder, Process(Path(folder), "demo", args) as demo:
        demo.wait_for("watching")
        (endpoint,) = re.findall(r"--connect (\S+)", demo.out)
        document = Document()
        with Tap(endpoint, keys.base.rpartition("/")[0]) as tap:
            (state,) = until(lambda: tap.ask(f"{keys.base}/state"), 60.0, "a guard's state")
            time.sleep(seconds)
            states = [state, *tap.ask(f"{keys.base}/state")]
            demo.signal_and_wait(signal.SIGINT)
            try:
                counts = tap.check(document, parameters)
                for body in states:
                    counts[document.check("state", body, "state")] += 1
            except (jsonschema.ValidationError, AssertionError) as error:
                print(error, file=sys.stderr)
                return 1
    for name, count in sorted(counts.items()):
        print(f"{count:6} {name}")
    print(f"{sum(counts.values()):6} messages in {seconds:g} s, all as the contract says")
    return 0


if __name__ == "__main__":
    sys.exit(main())
