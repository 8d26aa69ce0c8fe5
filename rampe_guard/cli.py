"""The command line: parses arguments, calls, prints. See ``rampe-guard --help``."""

from __future__ import annotations

import argparse
import faulthandler
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from rampe_guard import __version__
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
    add_scene_actions,
    add_site,
    add_watch,
    positive_int,
)

if TYPE_CHECKING:
    from rampe_guard.runtime.connecting import Network


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns its exit code (0, or 2 for an error that a user can mend)."""
    args = _parser().parse_args(argv)
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


# Each command imports what it needs: `schema` should not wait for meshes and Zenoh.


def _demo(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    from rich.console import Console

    from rampe_guard.programs.demo import demo

    return demo(args.cycles, args.seed, Console(), stop, args.dashboard)


def _run(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.supervisor import Supervisor, end_with_parent

    if args.supervisor:
        guard_command = [sys.executable, *args.again, "--no-supervisor"]
        return Supervisor(guard_command, log_format=args.log_format).run()
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    end_with_parent()
    faulthandler.enable()  # where a crash in native code came from

    def imported() -> Callable[[], int]:
        from rampe_guard.runtime.daemon import run
        from rampe_guard.runtime.say import configure

        configure(args.log_format)
        return lambda: run(args.site, args.connect, stop, args.operator, args.metrics)

    guard = stop.unless_stopped(imported)
    return 0 if guard is None else guard()


def _check(args: argparse.Namespace) -> int:
    from rich.console import Console

    from rampe_guard.programs.checkup import checkup

    return checkup(args.site, Console())


def _sweep(args: argparse.Namespace) -> int:
    from rampe_guard.programs.sweeping import sweep_lines

    for line in sweep_lines(args.site, sys.stdin.buffer):
        print(line.decode(), flush=True)
    return 0


def _watch(args: argparse.Namespace) -> int:
    from rich.console import Console

    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()
    if len(args.site) == 1 and not args.base and not args.json:
        from rampe_guard.programs.watch_one import watch_one

        return watch_one(args.site[0], _network(args), Console(), stop, bell=args.bell)
    from rampe_guard.programs.control_room import watch_many

    return watch_many(
        args.site, args.base, _network(args), Console(), stop, bell=args.bell, as_json=args.json
    )


def _network(args: argparse.Namespace) -> Network:
    from rampe_guard.runtime.connecting import Network

    return Network(tuple(args.connect), args.zenoh, args.plain_network)


def _dashboard(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    from rampe_guard.programs.dashboarding import Place, dashboard_sites
    from rampe_guard.runtime.log_lines import configure

    configure("text")

    def say(text: str) -> None:
        print(text, flush=True)

    place = Place(args.host, args.port, args.token_file, tuple(args.names))
    return dashboard_sites(args.site, args.connect, place, say, stop)


def _notify(args: argparse.Namespace) -> int:
    from rampe_guard.core.alarm import Level
    from rampe_guard.programs.notifying import Wishes, notify
    from rampe_guard.runtime.stopping import StopFlag

    wishes = Wishes(
        args.site,
        args.base,
        _network(args),
        Level[args.at_least.upper()],
        args.commands,
        args.post,
        args.sound,
        args.timeout,
        args.per_minute,
        args.log_format,
    )
    return notify(wishes, StopFlag.on_signals())


def _record(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    from rampe_guard.programs.recording import Wishes, record
    from rampe_guard.runtime.say import configure

    configure(args.log_format)
    until = (args.rotate_mb, args.rotate_minutes, vars(args)["for"])
    wishes = Wishes(args.site, args.out, args.connect, args.operator, *until)
    print(record(wishes, stop))
    return 0


def _replay(args: argparse.Namespace) -> int:
    from rampe_guard.programs.replaying import replay_offline
    from rampe_guard.programs.replaying_live import replay_live
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()
    if args.live:
        return replay_live(args.site, args.log, args.connect, args.speed, stop)
    wishes = {"repeats": args.repeats, "compare": args.compare, "fresh": args.fresh}
    for line in replay_offline(args.site, args.log, stop, **wishes):
        print(line.decode())
    return 0


def _evaluate(args: argparse.Namespace) -> int:
    from pathlib import Path

    from rich.console import Console

    from rampe_guard.programs.evaluating import Wishes, evaluate

    wishes = Wishes(
        args.site,
        tuple(args.log),
        args.fleet,
        Path(args.out),
        args.fresh,
        args.frozen,
        args.jobs,
        args.scheduler,
    )
    return evaluate(wishes, Console())


def _paper(args: argparse.Namespace) -> int:
    from rich.console import Console

    from rampe_guard.programs.paper import paper

    return paper(args.out, args.seeds, args.cycles, args.seed, Console())


def _model(args: argparse.Namespace) -> int:
    from rich.console import Console

    from rampe_guard.programs.modelling import export_model, reset_model, show_model

    if args.action == "export":
        print(export_model(args.site, args.operator).decode())
        return 0
    if args.action == "reset" and args.running:
        from rampe_guard.programs.watching import forget

        print(forget(args.site, args.connect, args.operator, args.who))
        return 0
    if args.action == "reset":
        return reset_model(args.site, args.operator, Console(soft_wrap=True), sure=args.yes)
    return show_model(args.site, args.operator, Console())


def _scene(args: argparse.Namespace) -> int:
    from rampe_guard.programs.scene_putting import put_scene, show_scene

    if args.action == "put":
        return put_scene(args.site, args.connect, args.file, args.who)
    return show_scene(args.site, args.connect)


def _schema(args: argparse.Namespace) -> int:
    from rampe_guard.programs.contract import contract_text, write_contract

    if args.out is not None:
        write_contract(args.out)
    else:
        print(contract_text(args.name), end="")
    return 0


def _access(args: argparse.Namespace) -> int:
    from rampe_guard.programs.access import write_router_config
    from rampe_guard.runtime.log_lines import one_line

    def note(text: str) -> None:
        print(f"note: {one_line(text)}", file=sys.stderr)

    print(write_router_config(args.file, args.out, note), end="")
    return 0


def _ack(args: argparse.Namespace) -> int:
    from rampe_guard.programs.watching import acknowledge

    return acknowledge(args.site, args.connect, args.alert, args.who)


def _shelve(args: argparse.Namespace) -> int:
    from rampe_guard.programs.watching import shelve

    return shelve(args.site, args.connect, args.alert, args.who, vars(args)["for"])


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

    add_site(commands.add_parser("check", help="validate site, scene, meshes and kinematics"))

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

    scene = commands.add_parser("scene", help="the scene in force of a guard that works")
    add_scene_actions(scene)
    model = commands.add_parser("model", help="what is kept of an operator's way of working")
    add_model_actions(model)

    schema = commands.add_parser("schema", help="JSON Schemas of messages and files, AsyncAPI")
    schema.add_argument(
        "name", nargs="?", help="one of them, such as rampe.alert.v1, or asyncapi: keys and QoS"
    )
    schema.add_argument("--out", metavar="FOLDER", help="write the message contract there instead")

    access = commands.add_parser("access", help="a router's file from the site's access list")
    access.add_argument("file", help="access list (YAML), such as deploy/access.example.yaml")
    access.add_argument("--out", metavar="FILE", help="write it there, not on standard output")

    ack = commands.add_parser("ack", help="acknowledge an alert")
    shelve = commands.add_parser("shelve", help="silence an alert for a short while")
    add_alert_requests(ack, shelve)
    for name, command in _COMMANDS.items():
        commands.choices[name].set_defaults(command=command)
    return parser


_COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "demo": _demo,
    "run": _run,
    "check": _check,
    "sweep": _sweep,
    "watch": _watch,
    "dashboard": _dashboard,
    "notify": _notify,
    "record": _record,
    "replay": _replay,
    "evaluate": _evaluate,
    "paper": _paper,
    "model": _model,
    "scene": _scene,
    "schema": _schema,
    "access": _access,
    "ack": _ack,
    "shelve": _shelve,
}


if __name__ == "__main__":
    sys.exit(main())
