"""What it costs to have frames as arrays, as a share of a core."""
import resource
import time
import unittest

import weft

from support import hung


def processor():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def share_of_a_core():
    with weft.serve() as server:
        session = server.create_session(hung(31, 31))
        session.run(until_frame=150, time_scale=1)
        frames = session.frames()
        next(frames)
        wall, begin = time.monotonic(), processor()
        lowest = [frame.positions[:, 1].min() for frame in frames]
        assert len(lowest) == 150
        return (processor() - begin) / (time.monotonic() - wall)


class Cost(unittest.TestCase):
    def test_a_sheet_at_60_frames_a_second_leaves_a_core_nearly_idle(self):
        share = share_of_a_core()
        print(f"{share:.2%} of a core")  # 3 to 4 % where nothing else runs
        self.assertLess(share, 0.2)


if __name__ == "__main__":
    unittest.main()
