"""Zenoh sessions as this project opens them: named endpoints only, no scouting, closed within a bounded time."""

import json
import re
import threading
import time
from contextlib import suppress

import zenoh

from grasping_invisible.runtime.errors import BadInput, LinkError

LOCATOR_FORM = "tcp/127.0.0.1:7447"
_LOCATOR = re.compile(r"(tcp|udp|tls|quic|ws)/\S+:\d+(#\S+)?|unixsock-stream/\S+")
_ATTEMPT_MS = 300  # one try to connect; short, so that Ctrl-C is heard between two tries
_CLOSE_SECONDS = 0.5


def check_locator(locator: str) -> str:
    """The locator itself, or `BadInput` when it is not one that zenoh can use."""
    if not _LOCATOR.fullmatch(locator):
        raise BadInput(f"{locator!r} is not a zenoh locator; one looks like {LOCATOR_FORM}")
    return locator


def listen(endpoint: str) -> zenoh.Session:
    """A session that others connect to, at `endpoint` and nowhere else. Raises `BadInput`."""
    config = _closed_config("peer")
    config.insert_json5("listen/endpoints", json.dumps([check_locator(endpoint)]))
    config.insert_json5("listen/exit_on_failure", "true")
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise BadInput(f"cannot listen at {endpoint}: {_cause(error)}") from error


def connect(endpoint: str, timeout: float) -> zenoh.Session:
    """A session connected to `endpoint`, tried again for `timeout` seconds. Raises `BadInput`, `LinkError`."""
    config = _closed_config("client")
    config.insert_json5("connect/endpoints", json.dumps([check_locator(endpoint)]))
    config.insert_json5("connect/timeout_ms", str(_ATTEMPT_MS))
    config.insert_json5("connect/exit_on_failure", "true")
    deadline = time.monotonic() + timeout
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if time.monotonic() >= deadline:
                raise LinkError(f"nothing answers at {endpoint} (tried for {timeout:g} s)") from error
        time.sleep(0.05)


def close(session: zenoh.Session) -> None:
    """Close a session; a peer that hangs is not waited for. Never raises."""
    closing = threading.Thread(target=_close_quietly, args=(session,), daemon=True)
    closing.start()
    closing.join(_CLOSE_SECONDS)


def _close_quietly(session: zenoh.Session) -> None:
    with suppress(zenoh.ZError):  # the other side is gone or hangs: there is nothing left to close
        session.close()


def _closed_config(mode: str) -> zenoh.Config:
    """Zenoh's defaults listen on every interface and announce themselves; these do neither."""
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    # A killed process would leave its shared memory behind; loopback is fast enough without.
    config.insert_json5("transport/shared_memory/enabled", "false")
    # A camera frame is many fragments: wait 50 ms for a busy reader before dropping it, not zenoh's 1 ms.
    config.insert_json5("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "50000")
    return config


def _cause(error: zenoh.ZError) -> str:
    """The part of zenoh's message that a person can use, without its source locations."""
    text = str(error).split(" at /")[0]
    found = re.search(r"\[.*?: (.+)", text)
    return (found.group(1) if found else text).rstrip("].")
