"""A thread that says the same thing again and again, whatever else its process does."""

import threading
from collections.abc import Callable

PERIOD = 0.1  # seconds: the 10 Hz of both sides' health topics


class Heartbeat:
    """Calls `beat` every `PERIOD` seconds, from its start until `stop`."""

    def __init__(self, beat: Callable[[], None], name: str) -> None:
        self._beat = beat
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; returns once it has said its last."""
        self._stopped.set()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        while True:
            self._beat()
            if self._stopped.wait(PERIOD):
                return
