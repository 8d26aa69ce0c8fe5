"""Targets by themselves: what they run and post, and how they say that they could not."""

from __future__ import annotations

import errno
import io
import json
import socket
import threading
import time
from pathlib import Path

import pytest

from rampe_guard.core.alarm import Level
from rampe_guard.errors import SettingsError
from rampe_guard.notify.choose import Notice
from rampe_guard.notify.command import Command
from rampe_guard.notify.messenger import Messenger
from rampe_guard.notify.post import Post
from rampe_guard.notify.sound import BELL, Sound
from rampe_guard.notify.target import NotHeardError
from rampe_guard.notify.tones import IMMINENT, WARNING
from rampe_guard.programs.notifying import Wishes, notify
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.stopping import StopFlag
from tests.support.processes import until

BODY = {"event": "alert", "level": "warning", "text": "a; b\x1b[2J", "zone": None, "over": False}
NOTICE = Notice("base", "zone wall", Level.WARNING, over=False, body=BODY)


def test_a_command_gets_words_environment_and_stdin_and_no_shell(tmp_path: Path) -> None:
    out = tmp_path / "out"
    script = f'echo "$1|$RAMPE_LEVEL|$RAMPE_ZONE|$(cat)" > {out}'
    Command(f"sh -c '{script}' name '{{text}} {{over}}'", 5.0).tell(NOTICE)
    words, level, zone, body = out.read_text().split("|")
    assert words == "a; b?[2J false"  # nothing that a terminal would obey
    assert (level, zone) == ("warning", "")
    assert json.loads(body) == BODY


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("false", "ended with code 1"),
        ("sh -c 'kill -9 $$'", "ended with signal 9"),
        ("{text}", "No such file"),
        ("sh -c 'sleep 60 & sleep 60'", "not done within 0.2 s"),
    ],
)
def test_a_command_that_fails_says_why(line: str, says: str) -> None:
    with pytest.raises(NotHeardError, match=says):
        Command(line, 0.2).tell(NOTICE)


def test_a_command_that_reads_nothing_was_told_all_the_same() -> None:
    big = Notice("base", "zone", Level.WARNING, over=False, body={**BODY, "link": "x" * 200_000})
    Command("true", 5.0).tell(big)


def test_after_stop_nothing_is_run_any_more() -> None:
    made = Command("true", 5.0)
    made.stop()
    with pytest.raises(NotHeardError, match="stopping"):
        made.tell(NOTICE)


def test_a_post_that_nobody_answers_says_so_without_its_secret() -> None:
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        port = deaf.getsockname()[1]
        with pytest.raises(NotHeardError, match="timed out") as told:
            Post(f"http://127.0.0.1:{port}/token-1234", 0.1).tell(NOTICE)
    assert "1234" not in str(told.value)
    with pytest.raises(NotHeardError, match="refused"):
        Post(f"http://127.0.0.1:{port}/", 0.5).tell(NOTICE)


@pytest.mark.parametrize("path", ["hush?hush", "hu sh/hush"])
def test_credentials_in_a_url_are_told_to_nobody_but_the_server(path: str) -> None:
    with pytest.raises(NotHeardError) as told:
        Post(f"http://user:hush@127.0.0.1:1/{path}", 0.5).tell(NOTICE)
    assert "hush" not in str(told.value)
    with pytest.raises(SettingsError, match="is no URL") as refused:
        Post("http://user:hush@x:99999/?hush", 0.5)
    assert "hush" not in str(refused.value)


def test_credentials_in_a_url_are_sent_as_they_should_be() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        post = Post(f"http://user:p%40ss@127.0.0.1:{server.getsockname()[1]}/x", 5.0)
        teller = threading.Thread(target=post.tell, args=(NOTICE,))
        teller.start()
        peer, _ = server.accept()
        with peer:
            heard = peer.recv(65536)
            peer.sendall(b"HTTP/1.1 204 No Content\r\n\r\n")
        teller.join(5.0)
    assert b"\r\nAuthorization: Basic dXNlcjpwQHNz\r\n" in heard  # user:p@ss
    assert heard.startswith(b"POST /x HTTP/1.1\r\n")


def test_a_fault_of_a_target_is_said_and_tried_again() -> None:
    class Broken:
        name = "broken"
        tries = 0

        def tell(self, notice: Notice) -> None:
            self.tries += 1
            if self.tries == 1:
                raise ValueError(notice.text)

        def stop(self) -> None:
            pass

    said: list[str] = []
    target = Broken()
    messenger = Messenger(target, 600.0, lambda _, text: said.append(text))
    messenger.offer(NOTICE)
    until(lambda: target.tries == 2, 5.0, "another try")
    messenger.stop()
    assert len(said) == 1
    assert "ValueError" in said[0]


def test_the_bell_rings_twice_for_a_warning_and_stops_at_once() -> None:
    terminal = io.StringIO()
    sound = Sound(BELL, lambda *_: None, terminal)
    try:
        sound.follow(WARNING)
        until(lambda: terminal.getvalue() == "\a\a", 5.0, "two bells")
        sound.follow(None)
    finally:
        sound.stop()
    assert terminal.getvalue() == "\a\a"


def test_a_terminal_that_goes_is_said_and_tried_again() -> None:
    class Gone(io.StringIO):
        there = False

        def write(self, text: str) -> int:
            if not self.there:
                raise OSError(errno.EIO, "Input/output error")
            return super().write(text)

    said: list[str] = []
    terminal = Gone()
    sound = Sound(BELL, lambda _, text: said.append(text), terminal)
    try:
        sound.follow(WARNING)
        until(lambda: said, 5.0, "words about it")
        terminal.there = True
        sound.follow(IMMINENT)
        until(terminal.getvalue, 5.0, "a bell again")
    finally:
        sound.stop()
    assert "Input/output error" in said[0]


def test_a_player_that_fails_is_said() -> None:
    said: list[str] = []
    sound = Sound("false", lambda _, text: said.append(text), io.StringIO())
    try:
        sound.follow(WARNING)
        until(lambda: said, 5.0, "words about it")
    finally:
        began_s = time.monotonic()
        sound.stop()
    assert time.monotonic() - began_s < 1.0
    assert said[0] == "no sound: false ended with code 1"


@pytest.mark.parametrize(
    ("wish", "says"),
    [
        ({"bases": ["a/b"]}, "nowhere to tell"),
        ({"posts": ["http://127.0.0.1:1/"]}, "give a SITE or --base"),
        ({"bases": ["a/b"], "posts": ["ftp://x"]}, "is no URL"),
        ({"bases": ["a/b"], "posts": ["http://x:99999/"]}, "is no URL"),
        ({"bases": ["a/b"], "commands": ["echo '"]}, "No closing quotation"),
        ({"bases": ["a/b"], "commands": [" "]}, "a command is empty"),
        ({"bases": ["a/b"], "commands": ["echo {colour}"]}, "no field {colour}"),
        ({"bases": ["a/b"], "sound": "no-such-player"}, "no program 'no-such-player'"),
        ({"site": "no-such-site.yaml", "commands": ["true"]}, "no-such-site.yaml"),
    ],
)
def test_wishes_that_cannot_be_are_refused(wish: dict[str, list[str]], says: str) -> None:
    nothing = Wishes(None, (), Network(), Level.WARNING, (), (), None, 1.0, 60.0)
    fields = {name: getattr(nothing, name) for name in Wishes.__slots__} | wish
    with pytest.raises(SettingsError, match=says):
        notify(Wishes(**fields), StopFlag())
