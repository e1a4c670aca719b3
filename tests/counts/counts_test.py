"""What a scene does not need costs no instructions. COUNTS (the program weft-counts) comes from the
environment. Callgrind counts on its own processor, with AVX2, and each time the same."""
import functools
import os
import re
import subprocess
import unittest

NOTHING = 1.005  # times the instructions of a scene that never had it


@functools.cache
def instructions(case):
    """Of four frames of 31 x 31 particles with 16 substeps each."""
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
         "--toggle-collect=weft::counts::counted*", os.environ["COUNTS"], case],
        capture_output=True, text=True, check=True, timeout=500)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


class Counts(unittest.TestCase):
    def test_frames_are_computed(self):
        self.assertGreater(instructions("plain"), 4 * 16 * 31 * 31 * 8)

    def test_a_collider_out_of_reach_costs_less_than_a_fiftieth(self):
        # what remains says how far the sheet has come
        self.assertLess(instructions("far_collider"), 1.02 * instructions("plain"))

    def test_damping_and_bending_that_are_off_cost_nothing(self):
        self.assertLess(instructions("no_damping"), instructions("plain"))
        self.assertLess(instructions("no_bending"), instructions("plain"))

    def test_bending_that_was_taken_away_costs_what_a_sheet_without_it_costs(self):
        self.assertLess(instructions("bending_taken_away"), NOTHING * instructions("no_bending"))

    def test_wind_is_paid_for_by_scenes_with_wind_alone(self):
        self.assertGreater(instructions("wind"), 1.1 * instructions("plain"))

    def test_tethers_cost_a_third_where_something_is_held_and_else_nothing(self):
        self.assertLess(instructions("tethers"), 1.33 * instructions("plain"))
        self.assertLess(instructions("unpinned_tethers"), NOTHING * instructions("unpinned"))

    def test_the_guard_costs_less_than_a_hundredth_of_a_frame_of_32_substeps(self):
        # templates take 44 and more
        unguarded = instructions("no_guard")
        self.assertLess(instructions("plain") - unguarded, 0.01 * 2 * unguarded)

    def test_sheets_of_triangles_pay_for_what_they_have_alone(self):
        plain = instructions("triangles")
        self.assertLess(instructions("triangles_no_damping"), NOTHING * plain)
        self.assertLess(instructions("triangles_no_bending"), 0.8 * plain)
        self.assertLess(instructions("triangles_far_collider"), 1.02 * plain)
        self.assertGreater(instructions("triangles_wind"), 1.1 * plain)

    def test_edges_of_a_box_out_of_reach_cost_nothing(self):
        self.assertLess(instructions("triangles_far_box"),
                        NOTHING * instructions("triangles_far_ball"))

    def test_bending_taken_from_triangles_costs_what_triangles_without_it_cost(self):
        self.assertLess(instructions("triangles_bending_taken_away"),
                        NOTHING * instructions("triangles_no_bending"))

    def test_a_scene_asleep_costs_nothing(self):
        self.assertLess(instructions("asleep"), 1e-4 * instructions("plain"))


if __name__ == "__main__":
    unittest.main()
