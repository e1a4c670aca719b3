"""A weftd of one's own."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
from typing import Sequence

from .errors import error

_MOST_FRAME_WORK = 10**15  # nobody else waits for it
_MOST_DRAINING = 10  # s


class Process:
    """A weftd on a free port of this machine. It ends when its standard input does, which this
    process holds: no end of this process, not even a kill, leaves it behind."""

    def __init__(
        self, data_dir: str | None, workers: int | None, weftd: str | None, arguments: Sequence[str]
    ):
        command = [
            weftd or find_weftd(),
            "--until-eof",
            "--port=0",
            f"--data-dir={data_dir or 'none'}",
            f"--max-frame-work={_MOST_FRAME_WORK}",
            "--log-level=warn",
            *([f"--workers={workers}"] if workers else []),
            *arguments,
        ]
        self._log = tempfile.TemporaryFile()
        self._child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,  # Ctrl-C is for this process
        )
        assert self._child.stdout
        said = self._child.stdout.readline().decode()
        if not said.startswith("weftd listening on "):
            self._child.wait(_MOST_DRAINING)
            self._log.seek(0)
            why = self._log.read().decode().strip() or f"it ended with {self._child.returncode}"
            self.end()
            raise error("FAILED_PRECONDITION", "SERVER_FAILED", f"weftd does not serve: {why}")
        self.address = said.split()[-1]
        self.pid = self._child.pid

    def end(self) -> None:
        child = self._child
        assert child.stdin and child.stdout
        child.stdin.close()
        try:
            child.wait(_MOST_DRAINING)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        child.stdout.close()
        self._log.close()


def find_weftd() -> str:
    """On PATH, or beside this package or interpreter."""
    places = [
        os.environ.get("PATH", os.defpath),
        str(pathlib.Path(__file__).resolve().parents[2] / "bin"),
        str(pathlib.Path(sys.executable).parent),
    ]
    found = shutil.which("weftd", path=os.pathsep.join(places))
    if not found:
        text = "there is no weftd on PATH; install the package weft, or name it: serve(weftd=...)"
        raise error("NOT_FOUND", "SERVER_MISSING", text)
    return found
