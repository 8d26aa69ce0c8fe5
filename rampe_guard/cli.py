"""The command line: parses arguments, calls, prints. See ``rampe-guard --help``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from rampe_guard import __version__
from rampe_guard.commands import COMMANDS
from rampe_guard.errors import RampeGuardError
from rampe_guard.options import (
    add_alert_requests,
    add_dashboard,
    add_demo,
    add_evaluate,
    add_log_format,
    add_metrics,
    add_model_actions,
    add_notify,
    add_operator,
    add_record,
    add_replay,
    add_router,
    add_scene_actions,
    add_simulate,
    add_site,
    add_watch,
    positive_int,
)
from rampe_guard.options_init import add_check, add_init
from rampe_guard.options_ros2 import add_ros2_actions
from rampe_guard.options_scene import add_scene_tools
from rampe_guard.resources import shipped_instead


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns its exit code (0, or 2 for an error that a user can mend)."""
    args = _parser().parse_args(argv)
    shipped_instead(args, lambda text: print(text, file=sys.stderr))
    # how to start this very command again; the interpreter knows it, unless we were called
    args.again = sys.orig_argv[1:] if argv is None else ["-m", "rampe_guard", *argv]
    try:
        code: int = args.command(args)
    except RampeGuardError as error:
        print(_complaint(error.lines, args), file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # `| head` has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:  # a full disk behind a redirection, say
        print(_complaint((str(error),), args), file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 2
    return code


def _complaint(lines: Sequence[str], args: argparse.Namespace) -> str:
    """The last words of a command that cannot go on; as all lines are, if it writes a log."""
    from rampe_guard.runtime.log_lines import complaint

    return complaint(lines, vars(args).get("log_format", "text"))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rampe-guard",
        description="Collision early warning for machines that a person drives.",
    )
    parser.add_argument("--version", action="version", version=f"rampe-guard {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    demo = commands.add_parser("demo", help="everything on this machine, live")
    add_demo(demo)

    run = commands.add_parser("run", help="the daemon")
    add_site(run, connect=True)
    add_operator(run)
    add_log_format(run)
    add_metrics(run)
    run.add_argument(
        "--no-supervisor",
        dest="supervisor",
        action="store_false",
        help="one process: do not watch over it, nor start it anew after a crash",
    )
    run.add_argument(
        "--no-spare",
        dest="spare",
        action="store_false",
        help="no second guard that waits, loaded, for the death of the first (some 80 MB)",
    )

    add_init(commands.add_parser("init", help="a site file from a URDF and a look at the machine"))
    add_check(commands.add_parser("check", help="validate site, scene, meshes and kinematics"))

    sweep = commands.add_parser("sweep", help="motions as JSON lines in, certificates out")
    add_site(sweep)

    watch = commands.add_parser("watch", help="one machine, or many, on the terminal")
    add_watch(watch)

    dashboard = commands.add_parser("dashboard", help="machines in the browser, in 3D")
    add_dashboard(dashboard)

    notify = commands.add_parser("notify", help="alerts to commands, URLs and a sound")
    add_notify(notify)

    record = commands.add_parser("record", help="all that a machine and its guard say, as MCAP")
    add_record(record)

    replay = commands.add_parser("replay", help="a recording, or a CSV log, through the guard")
    add_replay(replay)

    evaluate = commands.add_parser("evaluate", help="how good forecasts are on recorded work")
    add_evaluate(evaluate)

    paper = commands.add_parser("paper", help="the paper's experiment: figures, table, page")
    paper.add_argument("--out", default="paper", help="folder for the results (default paper)")
    paper.add_argument("--seeds", type=positive_int, default=20, help="runs (default 20)")
    paper.add_argument("--cycles", type=positive_int, default=23, help="of a run (default 23)")
    paper.add_argument("--seed", type=positive_int, default=1, help="of the first run (default 1)")

    scene = commands.add_parser("scene", help="the scene in force of a guard; scene files")
    add_scene_tools(add_scene_actions(scene))
    model = commands.add_parser("model", help="what is kept of an operator's way of working")
    add_model_actions(model)

    add_ros2_actions(commands.add_parser("ros2", help="topics, descriptions and bags of ROS 2"))

    schema = commands.add_parser("schema", help="JSON Schemas of messages and files, AsyncAPI")
    schema.add_argument(
        "name", nargs="?", help="one of them, such as rampe.alert.v1, or asyncapi: keys and QoS"
    )
    schema.add_argument("--out", metavar="FOLDER", help="write the message contract there instead")

    add_router(commands.add_parser("router", help="a Zenoh router, for first steps"))
    add_simulate(commands.add_parser("simulate", help="a machine where there is none"))

    access = commands.add_parser("access", help="a router's file from the site's access list")
    access.add_argument("file", help="access list (YAML), such as deploy/access.example.yaml")
    access.add_argument("--out", metavar="FILE", help="write it there, not on standard output")

    ack = commands.add_parser("ack", help="acknowledge an alert")
    shelve = commands.add_parser("shelve", help="silence an alert for a short while")
    add_alert_requests(ack, shelve)
    for name, command in COMMANDS.items():
        commands.choices[name].set_defaults(command=command)
    return parser


if __name__ == "__main__":
    sys.exit(main())
