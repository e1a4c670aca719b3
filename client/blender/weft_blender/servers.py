"""The server that computes: one that listens somewhere, else one of Blender's own."""
from __future__ import annotations

import pathlib
import threading
from typing import Callable

import weft


class Servers:
    """Keeps the connection, and the server if it is its own."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._server: weft.Server | None = None
        self._of: tuple[str, str, str] | None = None
        self._textiles: list[tuple[str, str]] = []
        self._asking: threading.Thread | None = None

    def get(self, address: str = "", token_file: str = "", tls_ca: str = "") -> weft.Server:
        """The server at an address; if that is empty one of its own, which ends with Blender."""
        with self._lock:
            if self._server is None or self._of != (address, token_file, tls_ca):
                self._close()
                self._of = address, token_file, tls_ca
                if address:
                    token = pathlib.Path(token_file).read_text().strip() if token_file else None
                    self._server = weft.connect(address, token, tls_ca=tls_ca or None)
                else:
                    self._server = weft.serve()
            return self._server

    def textiles(self, server: Callable[[], weft.Server]) -> list[tuple[str, str]]:
        """Names and what people call them, of presets that are complete: what is known of them;
        the first call asks, and does not wait."""
        if not self._textiles and not (self._asking and self._asking.is_alive()):
            self._asking = threading.Thread(target=self._ask, args=[server], daemon=True)
            self._asking.start()
        return self._textiles

    def _ask(self, server: Callable[[], weft.Server]) -> None:
        try:
            self._textiles = [
                (each.name.removeprefix("textiles/"), each.display_name)
                for each in server().textiles()
                if not each.missing
            ]
        except (weft.Error, OSError, ValueError):  # the last where it is closed meanwhile
            pass  # whoever simulates is told

    def close(self) -> None:
        """Ends the connection, and the server of its own."""
        with self._lock:
            self._close()

    def _close(self) -> None:
        if self._server:
            self._server.close()
        self._server, self._textiles = None, []
