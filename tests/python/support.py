"""Scenes and servers of the tests."""
import os
import socket
import subprocess
import threading

import numpy as np
import weft

FALL = weft.Scene([weft.Sheet.grid(5, 6, 0.05, weft.Textile.preset("wool_tropical"))])


def hung(rows=11, columns=11):
    """A sheet that hangs by two corners."""
    sheet = weft.Sheet.grid(rows, columns, 0.05, weft.Textile.preset("wool_tropical"),
                            pins=[weft.Pin([0, columns - 1])])
    return weft.Scene([sheet])


def octahedron(radius):
    """A closed mesh: (6, 3) and (8, 3)."""
    corners = radius * np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = [[2, 4, 0], [2, 0, 5], [2, 5, 1], [2, 1, 4], [3, 0, 4], [3, 5, 0], [3, 1, 5], [3, 4, 1]]
    return corners, faces


def triangles(rows, columns, spacing):
    """A flat mesh in the plane y = 0: positions (n, 3), faces (m, 3), uv (n, 2)."""
    r, c = np.divmod(np.arange(rows * columns), columns)
    positions = np.stack([c * spacing, 0 * c, r * spacing], axis=1)
    faces = weft.frame.grid_triangles(rows, columns)
    return positions, faces, np.stack([r * spacing, c * spacing], axis=1)


class Weftd:
    """A weftd that is killed and started again, with its sessions, at the same address."""

    def __init__(self, directory, *arguments):
        pid = os.getpid()
        # of this process, so that a port stays free while weftd is gone
        self.host = f"127.{1 + (pid >> 16) % 250}.{pid >> 8 & 255}.{1 + (pid & 255) % 250}"
        self.arguments = [f"--data-dir={directory}", f"--host={self.host}", "--snapshot-ms=5",
                          "--log-level=error", *arguments]
        self.port = "0"
        self.start()

    def start(self):
        self.process = subprocess.Popen(["weftd", f"--port={self.port}", *self.arguments],
                                        stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().split()[-1]
        self.port = self.address.rsplit(":", 1)[1]

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def kill_and_start(self):
        self.kill()
        self.start()


class Proxy:
    """A road to a server that breaks on request."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.to = host, int(port)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.sockets = []
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
                far = socket.create_connection(self.to)
            except OSError:
                return
            self.sockets += near, far
            for a, b in (near, far), (far, near):
                threading.Thread(target=self.carry, args=(a, b), daemon=True).start()

    @staticmethod
    def carry(a, b):
        try:
            while data := a.recv(65536):
                b.sendall(data)
        except OSError:
            pass

    def drop(self):
        """Breaks every connection."""
        dropped, self.sockets = self.sockets, []
        for each in dropped:
            try:
                each.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            each.close()

    def close(self):
        self.listener.close()
        self.drop()
