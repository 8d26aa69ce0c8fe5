"""Options of the command line that several commands share, or that are many."""

from __future__ import annotations

import argparse
from typing import Any

from rampe_guard.runtime.log_lines import FORMATS


def add_watch(watch: argparse.ArgumentParser) -> None:
    """Machines, and how they are shown."""
    watch.add_argument("site", nargs="*", help="site files (YAML); one alone is shown in detail")
    watch.add_argument(
        "--base",
        action="append",
        default=[],
        metavar="KEYEXPR",
        help="guards by the prefix of their keys, such as 'rampe/*/*/guard'",
    )
    add_connect(watch)
    add_network(watch)
    watch.add_argument("--bell", action="store_true", help="ring the terminal's bell")
    watch.add_argument("--json", action="store_true", help="one JSON object a line, for scripts")


def add_notify(parser: argparse.ArgumentParser) -> None:
    """Machines, and whom to tell of their alerts."""
    parser.add_argument("site", nargs="?", help="site file (YAML): its machine, its network")
    parser.add_argument(
        "--base",
        action="append",
        default=[],
        metavar="KEYEXPR",
        help="machines by the prefix of their guards' keys, such as 'rampe/*/*/guard'",
    )
    add_connect(parser)
    add_network(parser)
    add_log_format(parser)
    parser.add_argument(
        "--at-least",
        choices=("caution", "warning", "imminent"),
        default="warning",
        help="level from which on to tell (default warning); lost protection is always told",
    )
    parser.add_argument(
        "--command",
        action="append",
        default=[],
        dest="commands",
        metavar="LINE",
        help="run it, without a shell; {text}, {level} and more are replaced, JSON on its stdin",
    )
    parser.add_argument(
        "--post", action="append", default=[], metavar="URL", help="post JSON to it"
    )
    parser.add_argument(
        "--sound",
        metavar="PLAYER",
        help="play a WAV file with it until acknowledged, such as 'aplay -q'; or: bell",
    )
    parser.add_argument(
        "--timeout", type=positive, default=5.0, help="of each try, in seconds (default 5)"
    )
    parser.add_argument(
        "--per-minute",
        type=positive,
        default=60.0,
        help="what each command and URL may get in the long run (default 60)",
    )


def add_model_actions(model: argparse.ArgumentParser) -> None:
    """What to do with what was learned."""
    actions = model.add_subparsers(required=True, metavar="ACTION", dest="action")
    for action, text in (
        ("show", "print what was learned"),
        ("reset", "delete it, for good"),
        ("export", "print it as JSON"),
    ):
        parser = actions.add_parser(action, help=text)
        add_site(parser)
        add_operator(parser)
        if action == "reset":
            parser.add_argument("--yes", action="store_true", help="needed on a terminal")
            parser.add_argument(
                "--running", action="store_true", help="ask the guard that runs to forget"
            )
            add_connect(parser)
            parser.add_argument("--who", help="who wants it so (default: the user's name)")


def add_scene_actions(scene: argparse.ArgumentParser) -> argparse._SubParsersAction[Any]:
    """What to do with the scene of a guard that works; further actions may be added."""
    actions = scene.add_subparsers(required=True, metavar="ACTION", dest="action")
    for action, text in (
        ("show", "print the scene in force"),
        ("put", "replace it by another, which is validated first"),
    ):
        parser = actions.add_parser(action, help=text)
        add_site(parser, connect=True)
        if action == "put":
            parser.add_argument("file", help="scene file (YAML)")
            parser.add_argument("--who", help="who puts it (default: the user's name)")
    return actions


def add_evaluate(parser: argparse.ArgumentParser) -> None:
    """Which logs, what is learned from which, and who does the work."""
    parser.add_argument("site", nargs="?", help="site file (YAML)")
    parser.add_argument("log", nargs="*", help="logs of one operator, in order of time")
    parser.add_argument("--out", default="evaluation", help="folder (default evaluation/)")
    parser.add_argument("--fresh", action="store_true", help="learn each log from nothing")
    parser.add_argument(
        "--frozen",
        type=positive_int,
        metavar="K",
        help="learn from the first K logs, then nothing more; judge the others",
    )
    parser.add_argument("--jobs", type=positive_int, help="processes (default: one per core)")
    parser.add_argument(
        "--fleet", metavar="FILE", help="operators, sites and logs (YAML) instead of SITE and LOG"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers do the work"
    )


def add_site(parser: argparse.ArgumentParser, *, connect: bool = False) -> None:
    """The site file, and another network than it names."""
    parser.add_argument("site", help="site file (YAML)")
    if connect:
        add_connect(parser)


def add_demo(parser: argparse.ArgumentParser) -> None:
    """How long, and on which screen."""
    parser.add_argument("--cycles", type=positive_int, default=6, help="work cycles (default 6)")
    parser.add_argument("--seed", type=int, default=13, help="of the operator's day (default 13)")
    parser.add_argument(
        "--dashboard",
        type=port,
        nargs="?",
        const=8080,
        metavar="PORT",
        help="in the browser instead, on this port (default 8080)",
    )
    parser.add_argument(
        "--obey",
        action="store_true",
        help="the machine follows the guard's speed advice; the time that costs is told",
    )


def add_router(parser: argparse.ArgumentParser) -> None:
    """Where it listens."""
    parser.add_argument(
        "endpoint", nargs="*", help="to listen on (default tcp/127.0.0.1:7447: this machine alone)"
    )
    parser.add_argument(
        "--config", metavar="FILE", help="its Zenoh configuration (json5) instead of endpoints"
    )


def add_simulate(parser: argparse.ArgumentParser) -> None:
    """Which machine, for how long, and where it goes."""
    parser.add_argument(
        "arm",
        nargs="?",
        default="config/sites/demo.yaml",
        help="site file (YAML) or, with --out, a URDF (default: the demo's excavator at work)",
    )
    parser.add_argument("--out", metavar="FILE", help="write a CSV log, instead of playing live")
    text = "work cycles, or pushes of each lever each way (default 3; live the demo goes on)"
    parser.add_argument("--cycles", type=positive_int, help=text)
    parser.add_argument("--seed", type=int, default=1, help="of operator and noise (default 1)")
    add_connect(parser)


def add_dashboard(parser: argparse.ArgumentParser) -> None:
    """Machines, and where the page is served."""
    parser.add_argument("site", nargs="+", help="site files (YAML), one per machine")
    add_connect(parser)
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="to listen on (default 127.0.0.1); beyond loopback pages need a token",
    )
    parser.add_argument("--port", type=port, default=8080, help="0: any free (default 8080)")
    parser.add_argument(
        "--token-file",
        metavar="FILE",
        help="holds the token that pages need, mode 0600; without it one is made and printed",
    )
    parser.add_argument(
        "--name",
        action="append",
        default=[],
        dest="names",
        help="further host name by which browsers call it, such as that of a proxy before it",
    )


def add_record(parser: argparse.ArgumentParser) -> None:
    """Machine, file, and when the next file begins."""
    add_site(parser, connect=True)
    add_log_format(parser)
    parser.add_argument("out", help="file to begin with, such as OUT.mcap; OUT-0002.mcap follows")
    add_operator(parser)
    size, age = "size at which the next file begins", "age at which it does"
    parser.add_argument("--rotate-mb", type=positive, default=1000.0, help=f"{size} (default 1000)")
    parser.add_argument("--rotate-minutes", type=positive, default=60.0, help=f"{age} (default 60)")
    text = "for how long; without it until it is stopped"
    parser.add_argument("--for", type=positive, metavar="SECONDS", help=text)


def add_replay(parser: argparse.ArgumentParser) -> None:
    """A log, and what becomes of it."""
    parser.add_argument("site", nargs="?", help="site file (YAML) instead of the recorded one")
    parser.add_argument("log", help="recording (MCAP), or a CSV file as the site file's 'log' says")
    add_connect(parser)
    parser.add_argument("--live", action="store_true", help="publish its inputs onto Zenoh instead")
    speed = "with --live (default 1; slower needs inputs.max_clock_loss)"
    parser.add_argument("--speed", type=positive, default=1.0, help=speed)
    parser.add_argument("--repeats", action="store_true", help="also print repeats of alerts")
    parser.add_argument(
        "--compare", action="store_true", help="with the alerts that were given live, on stderr"
    )
    parser.add_argument(
        "--fresh", action="store_true", help="without what had been learned before the recording"
    )


def add_connect(parser: argparse.ArgumentParser) -> None:
    """Zenoh endpoints."""
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="Zenoh endpoint instead of the site file's, such as tcp/127.0.0.1:7447",
    )


def add_network(parser: argparse.ArgumentParser) -> None:
    """How to join a network without a site file."""
    parser.add_argument(
        "--zenoh",
        metavar="FILE",
        help="Zenoh configuration file (json5; certificates, users) for --base, not --connect",
    )
    parser.add_argument(
        "--plain-network",
        action="store_true",
        help="accept that anyone on the network of --connect can read and forge messages",
    )


def add_alert_requests(ack: argparse.ArgumentParser, shelve: argparse.ArgumentParser) -> None:
    """Which alert, and who asks."""
    for parser, who in ((ack, "who has seen it"), (shelve, "who wants it silent")):
        add_site(parser, connect=True)
        parser.add_argument("alert", help="its alert_id")
        parser.add_argument("--who", required=True, help=who)
    text = "for how long; 0 ends its silence"
    shelve.add_argument("--for", type=seconds, required=True, metavar="SECONDS", help=text)


def add_log_format(parser: argparse.ArgumentParser) -> None:
    """For people, or for programs."""
    parser.add_argument(
        "--log-format",
        choices=FORMATS,
        default="text",
        help="of the log on stderr: text, or one JSON object a line (default text)",
    )


def add_metrics(parser: argparse.ArgumentParser) -> None:
    """Where Prometheus finds the guard."""
    parser.add_argument(
        "--metrics",
        type=address,
        metavar="[HOST:]PORT",
        help="serve /metrics there for Prometheus, instead of where the site file says; on"
        " 127.0.0.1 unless another host is given",
    )


def add_operator(parser: argparse.ArgumentParser) -> None:
    """Who is working."""
    text = "who is at the levers, instead of whom the site file names"
    parser.add_argument("--operator", metavar="NAME", help=text)


def seconds(text: str) -> float:
    """A time [s], 0 too."""
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not 0 or above")
    return value


def positive(text: str) -> float:
    """A number above 0."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def address(text: str) -> tuple[str, int]:
    """A host, 127.0.0.1 if there is none, and a TCP port."""
    host, _, number = text.rpartition(":")
    return host.strip("[]") or "127.0.0.1", port(number)


def port(text: str) -> int:
    """A TCP port; 0 is any free one."""
    value = int(text)
    if not 0 <= value <= 65535:  # noqa: PLR2004 - what TCP has
        raise argparse.ArgumentTypeError(f"{value} is no port")
    return value


def positive_int(text: str) -> int:
    """A whole number above 0."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value
