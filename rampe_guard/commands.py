"""What each command does with its arguments; each returns its exit code.

Each imports what it needs: `schema` should not wait for meshes and Zenoh.
"""

from __future__ import annotations

import argparse
import faulthandler
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rampe_guard.runtime.connecting import Network


def _demo(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    from rich.console import Console

    from rampe_guard.programs.demo import demo

    return demo(args.cycles, args.seed, Console(), stop, args.dashboard, obey=args.obey)


def _run(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.life import await_turn, take_name
    from rampe_guard.runtime.supervisor import SPARE_AFTER_S, Supervisor, end_with_parent

    if args.supervisor:
        guard_command = [sys.executable, *args.again, "--no-supervisor"]
        spare_after_s = SPARE_AFTER_S if args.spare else None
        return Supervisor(
            guard_command, log_format=args.log_format, spare_after_s=spare_after_s
        ).run()
    from rampe_guard.runtime.allocator import keep_level
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    keep_level()
    take_name()
    end_with_parent()
    faulthandler.enable()  # where a crash in native code came from

    def imported() -> Callable[[], int]:
        from rampe_guard.runtime.daemon import run
        from rampe_guard.runtime.say import configure

        configure(args.log_format)
        return lambda: run(args.site, args.connect, stop, args.operator, args.metrics)

    guard = stop.unless_stopped(imported)
    return 0 if guard is None or not await_turn(stop) else guard()


def _init(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()
    from rich.console import Console

    from rampe_guard.programs.initing import init, terminal
    from rampe_guard.programs.initing_wishes import Wishes

    return init(Wishes.of(vars(args)), Console(), stop, None if args.yes else terminal())


def _check(args: argparse.Namespace) -> int:
    from rich.console import Console

    from rampe_guard.programs.checkup import checkup
    from rampe_guard.programs.checkup_live import Live
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()
    live = Live(tuple(args.connect), args.seconds, stop) if args.live else None
    return checkup(args.site, Console(), args.picture, live)


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

    # said before the imports, which take a while, and so does all the rest
    many = f"{len(args.log)} logs" if len(args.log) > 1 else " ".join(args.log)
    what = many if args.fleet is None else f"the sequences of {args.fleet}"
    if args.log or args.fleet is not None:
        print(f"evaluating {what}: a minute of work takes some ten seconds", file=sys.stderr)
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
    if args.action in {"import", "export", "diff"}:
        return _scene_files(args)
    from rampe_guard.programs.scene_putting import put_scene, show_scene

    if args.action == "put":
        return put_scene(args.site, args.connect, args.file, args.who)
    return show_scene(args.site, args.connect)


def _scene_files(args: argparse.Namespace) -> int:
    if args.action == "import":
        from rampe_guard.programs.scene_importing import Wishes, import_scene

        return import_scene(Wishes.of(vars(args)))
    if args.action == "export":
        from rampe_guard.programs.scene_exporting import export_scene

        return export_scene(args.file, args.out, args.allow)
    from rampe_guard.programs.scene_diffing import diff_scenes

    return diff_scenes(args.old, args.new, args.allow, as_json=args.json)


def _router(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.router import route
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()
    endpoints = args.endpoint or ([] if args.config else ["tcp/127.0.0.1:7447"])
    return route(endpoints, args.config, stop)


def _simulate(args: argparse.Namespace) -> int:
    from rampe_guard.runtime.stopping import StopFlag

    stop = StopFlag.on_signals()  # before the imports, which take a while
    from rampe_guard.programs.simulating import Wishes, play, write_log

    wishes = Wishes(args.arm, args.cycles, args.seed)
    if args.out is None:
        return play(wishes, args.connect, stop)
    print(write_log(wishes, args.out))
    return 0


def _ros2(args: argparse.Namespace) -> int:
    from rampe_guard.programs.ros2_tools import save_description, topic_lines, write_bag

    if args.action == "topics":
        print("\n".join(topic_lines(args.site)))
        return 0
    if args.action == "bag":
        print(write_bag(args.site, args.log, args.out))
        return 0
    wishes = (args.source, args.out, args.topic, args.connect, args.wait)
    print(save_description(*wishes, force=args.force))
    return 0


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


COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "demo": _demo,
    "run": _run,
    "init": _init,
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
    "ros2": _ros2,
    "schema": _schema,
    "router": _router,
    "simulate": _simulate,
    "access": _access,
    "ack": _ack,
    "shelve": _shelve,
}
"""By name."""
