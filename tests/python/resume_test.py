"""Frames after a connection or a server was cut off: every one once, equal to the bit."""
import asyncio
import tempfile
import unittest

import weft

from support import Proxy, Weftd, hung

LAST = 240
KILLS = {40, 41, 170}
DENIM = weft.Textile.preset("denim_11oz")


def undisturbed():
    with weft.serve() as server:
        session = server.create_session(hung())
        session.step(30)
        session.set_textile(DENIM, over=2)
        session.run(until_frame=LAST)
        return [frame.positions.tobytes() for frame in session.frames()]


class Resume(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.expected = undisturbed()

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.weftd = Weftd(directory.name)
        self.addCleanup(lambda: self.weftd.kill())

    def check(self, frames):
        self.assertEqual([number for number, _ in frames], list(range(LAST + 1)))
        for (number, found), expected in zip(frames, self.expected):
            self.assertEqual(found, expected, f"frame {number}")

    def read(self, address, interrupt):
        with weft.connect(address) as server:
            session = server.create_session(hung())
            interrupt()
            session.step(30)
            session.set_textile(DENIM, over=2)
            session.run(until_frame=LAST, time_scale=4)
            frames = []
            for frame in session.frames():
                frames.append((frame.number, frame.positions.tobytes()))
                if frame.number in KILLS:
                    interrupt()
        return frames

    def test_through_kills_of_the_server(self):
        self.check(self.read(self.weftd.address, self.weftd.kill_and_start))

    def test_awaited_through_kills_of_the_server(self):
        async def read():
            async with weft.aio.connect(self.weftd.address) as server:
                session = await server.create_session(hung())
                await session.step(30)
                await session.set_textile(DENIM, over=2)
                await session.run(until_frame=LAST, time_scale=4)
                frames = []
                async for frame in session.frames():
                    frames.append((frame.number, frame.positions.tobytes()))
                    if frame.number in KILLS:
                        self.weftd.kill_and_start()
                return frames

        self.check(asyncio.run(read()))

    def test_through_broken_connections(self):
        proxy = Proxy(self.weftd.address)
        self.addCleanup(proxy.close)
        self.check(self.read(proxy.address, proxy.drop))

    def test_calls_are_carried_out_once(self):
        with weft.connect(self.weftd.address) as server:
            session = server.create_session(hung())
            for number in range(1, 5):
                self.weftd.kill_and_start()
                self.assertEqual(session.step().frame, number)

    def test_views_go_on(self):
        with weft.connect(self.weftd.address) as server:
            session = server.create_session(hung())
            session.run(time_scale=1)
            view = session.view()
            last = next(view).number
            self.weftd.kill_and_start()
            for _ in range(5):
                shown = next(view).number
                self.assertGreaterEqual(shown, last)
                last = shown
            view.close()


if __name__ == "__main__":
    unittest.main()
