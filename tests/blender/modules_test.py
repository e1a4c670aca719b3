"""The parts of the add-on that need no Blender, against a real server. ADDON is the zip."""
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import weft

sys.path.insert(0, os.environ["ADDON"])
from weft_blender.cache import Cache, read  # noqa: E402
from weft_blender.run import Run, Target  # noqa: E402
from weft_blender.scene import Body, Cloth, Surface, World, keyframes, prepare  # noqa: E402
from weft_blender.servers import Servers  # noqa: E402
from weft_blender.surface import Refused, flat_shape  # noqa: E402

UPRIGHT = np.eye(3)[1:]
WORLD = World(1 / 25, 1, (0, 0, -9.80665))


def grid(rows=9, columns=9, spacing=0.05):
    """A level sheet, (n, 3) and (m, 3): x along rows, y from row to row, faces look up."""
    r, c = np.divmod(np.arange(rows * columns), columns)
    return (np.stack([c * spacing, r * spacing, 0.0 * r], axis=1),
            weft.frame.grid_triangles(rows, columns)[:, ::-1].astype(int))


def level(uv=None, **size):
    points, triangles = grid(**size)
    return Surface(points, triangles, None if uv is None else uv(points)[triangles], UPRIGHT)


def turned(angle, axis):
    """A rotation, (3, 3)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def lengths(points, triangles):
    return np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, 1)], axis=2)


def areas(points, triangles):
    """Positive where corners run anticlockwise."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


def folded():
    """A sheet with a right-angled fold along a row, and its UV map, 3 m for 1."""
    points, triangles = grid()
    bent = points.copy()
    over = points[:, 1] > 0.2
    bent[over] = np.stack([points[over, 0], 0 * points[over, 1] + 0.2, points[over, 1] - 0.2], 1)
    return Surface(bent, triangles, points[triangles][:, :, :2] / 3, UPRIGHT), points


def cube(size=0.2):
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * size
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
             [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return Surface(points, np.array(faces))


class FlatShapes(unittest.TestCase):
    def test_a_mesh_in_a_plane_is_flat_as_it_lies_in_every_direction(self):
        for seed in range(10):
            random = np.random.default_rng(seed)
            turn = turned(random.uniform(0, 6), random.normal(size=3))
            surface = level()
            surface.points = surface.points @ turn.T + random.normal(size=3)
            flat = flat_shape(surface, "AUTO", None, "a")
            np.testing.assert_allclose(lengths(flat.corners, flat.triangles),
                                       lengths(surface.points, surface.triangles), atol=1e-12)
            self.assertGreater(areas(flat.corners, flat.triangles).min(), 0)

    def test_the_warp_runs_along_its_own_y_and_along_z_where_it_stands(self):
        for angle, along in (0, 1), (np.pi / 2, 2):
            surface = level()
            surface.points = surface.points @ turned(angle, (1, 0, 0)).T
            flat = flat_shape(surface, "LYING", None, "a")
            np.testing.assert_allclose(flat.corners[:, 1], surface.points[:, along], atol=1e-12)

    def test_a_mesh_that_is_bent_is_flat_as_its_uv_map_at_the_scale_of_its_edges(self):
        surface, cut = folded()
        flat = flat_shape(surface, "AUTO", None, "a")
        np.testing.assert_allclose(lengths(flat.corners, flat.triangles),
                                   lengths(cut, surface.triangles), atol=1e-6)
        self.assertEqual(flat.notes, [])
        given = flat_shape(surface, "AUTO", 1.5, "a")
        np.testing.assert_allclose(given.corners, flat.corners / 2, atol=1e-6)
        self.assertIn("2 to 2 times as long", given.notes[0])

    def test_islands_that_are_mirrored_are_turned_over_about_the_warp(self):
        surface, cut = folded()
        surface.uv = surface.uv * [-1, 1]
        flat = flat_shape(surface, "UV", None, "a")
        self.assertGreater(areas(flat.corners, flat.triangles).min(), 0)
        np.testing.assert_allclose(np.sort(flat.corners[:, 1]), np.sort(cut[:, 1]), atol=1e-6)
        self.assertIn("1 island is mirrored", flat.notes[0])

    def test_a_seam_of_the_uv_map_gives_a_vertex_two_corners(self):
        surface, cut = folded()
        surface.uv[len(surface.uv) // 2:] += [0.5, 0]
        flat = flat_shape(surface, "UV", None, "a")
        self.assertEqual(len(flat.corners), len(cut) + 9)

    def test_a_uv_map_of_other_proportions_than_the_mesh_is_said_with_figures(self):
        surface, _ = folded()
        surface.uv = surface.uv * [1, 2]
        (note,) = flat_shape(surface, "UV", None, "shirt").notes
        self.assertRegex(note, "^shirt: its edges are 0.[0-9]+ to [0-9.]+ times as long")

    def test_what_has_no_flat_shape_is_refused_by_name(self):
        bent, _ = folded()
        bent.uv = None
        with self.assertRaisesRegex(Refused, "shirt: lies in no plane and has no UV map"):
            flat_shape(bent, "AUTO", None, "shirt")
        with self.assertRaisesRegex(Refused, "shirt: [0-9]+ vertices lie outside the plane"):
            flat_shape(bent, "LYING", None, "shirt")
        with self.assertRaisesRegex(Refused, "shirt: its UV map is a point"):
            flat_shape(level(lambda points: 0 * points[:, :2]), "UV", None, "shirt")
        with self.assertRaisesRegex(Refused, "shirt: has no faces"):
            flat_shape(Surface(np.zeros((3, 3)), np.zeros((0, 3), int)), "AUTO", None, "shirt")


class Scenes(unittest.TestCase):
    def test_held_vertices_that_go_together_are_one_pin(self):
        away = np.zeros((5, 3, 3))
        away[1:, :2, 0] = 0.1  # two of three vertices, from the second frame on
        cloth = Cloth("a", level(), "denim_11oz", [0, 1, 8], away + 7)
        pins = {tuple(each.particles): each.path
                for each in prepare(WORLD, [cloth], []).scene.sheets[0].pins}
        self.assertEqual(pins[(8,)], [])
        self.assertEqual([round(each.time_s, 9) for each in pins[(0, 1)]], [0, 0.04, 0.16])
        np.testing.assert_allclose(pins[(0, 1)][1].offset_m, (0.1, 0, 0), atol=1e-9)

    def test_a_path_has_no_keyframes_within_a_pause(self):
        offsets = np.zeros((10, 3))
        self.assertEqual(keyframes(offsets, 0.1), [])
        offsets[5:] = 1
        self.assertEqual([round(each.time_s, 9) for each in keyframes(offsets, 0.1)],
                         [0, 0.4, 0.5, 0.9])

    def test_a_body_that_moves_has_a_path_and_one_that_turns_has_poses(self):
        body = cube()
        ways = np.linspace(0, 1, 6)[:, None] * [0, 0, 0.5]
        moves = body.points + ways[:, None]
        cloth = Cloth("a", level(), "denim_11oz")
        (collider,) = prepare(WORLD, [cloth], [Body("box", body, moves)]).scene.colliders
        np.testing.assert_allclose([each.offset_m for each in collider.path], ways, atol=1e-6)
        moves[4] = body.points @ turned(0.1, (0, 0, 1)).T
        (collider,) = prepare(WORLD, [cloth], [Body("box", body, moves)]).scene.colliders
        poses = collider.shape.source.poses
        self.assertEqual(collider.path, [])
        np.testing.assert_allclose(poses.times_s, np.arange(6) * 0.04, atol=1e-9)
        np.testing.assert_allclose(poses.positions_m, moves)

    def test_a_floor_that_turns_is_refused(self):
        moves = np.array([level().points @ turned(angle, (1, 0, 0)).T for angle in (0, 0.1)])
        with self.assertRaisesRegex(Refused, "floor: is flat, .* cannot turn"):
            prepare(WORLD, [Cloth("a", level(), "denim_11oz")], [Body("floor", level(), moves)])

    def test_a_flat_body_is_a_floor(self):
        floor = level()
        prepared = prepare(WORLD, [Cloth("a", level(), "denim_11oz")], [Body("floor", floor)])
        self.assertEqual(tuple(prepared.scene.colliders[0].shape.normal), (0, 0, 1))
        self.assertIn("floor: is flat, so it is a floor without end", prepared.notes)

    def test_objects_of_any_name_have_sheets_of_names_of_their_own(self):
        names = ["Seide.001", "seide 001", "シルク", "x" * 200, "X" * 200]
        cloths = [Cloth(name, level(), "denim_11oz") for name in names]
        prepared = prepare(WORLD, cloths, [])
        self.assertEqual(len(prepared.cloths), 5)
        self.assertEqual(prepared.sheet_of("seide 001"), "seide-001-2")
        with weft.serve() as server:
            server.check(prepared.scene)

    def test_a_scene_without_cloth_is_refused(self):
        with self.assertRaisesRegex(Refused, "There is no cloth"):
            prepare(WORLD, [], [])


class Caches(unittest.TestCase):
    def test_a_cache_is_whole_after_every_frame(self):
        frames = np.random.default_rng(1).normal(size=(4, 5, 3)).astype("<f4")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "new" / "a.pc2"
            cache = Cache(path, frames[0])
            for count in range(1, 5):
                data = path.read_bytes()
                # as the format says, at its places
                self.assertEqual(data[:12], b"POINTCACHE2\0")
                self.assertEqual(struct.unpack_from("<2i2fi", data, 12), (1, 5, 0, 1, count))
                self.assertEqual(data[32:], frames[:count].tobytes())
                if count < 4:
                    cache.append(frames[count])
            cache.close()
            np.testing.assert_array_equal(read(path), frames)


class Runs(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.server = weft.serve()
        self.addCleanup(self.server.close)

    def run_of(self, prepared, last=20, to=np.eye(4)):
        targets = {sheet: Target(self.folder / f"{sheet}.pc2", to[None])
                   for sheet in prepared.cloths}
        return Run(lambda: self.server, prepared, targets, last)

    def refusal(self, cloth, bodies=()):
        run = self.run_of(prepare(WORLD, [cloth], bodies))
        run.join()
        self.assertIsNotNone(run.refused)
        return run.refused

    def wait(self, run, frame):
        until = time.monotonic() + 60
        while run.newest < frame and run.running and time.monotonic() < until:
            time.sleep(0.001)
        self.assertGreaterEqual(run.newest, frame)

    def test_caches_hold_what_weft_records_in_the_objects_own_coordinates(self):
        hung = Cloth("hung", level(), "wool_tropical", [0, 8])
        other = level()
        other.points = other.points + [0, 0, 1]
        prepared = prepare(WORLD, [hung, Cloth("falls", other, "denim_11oz")], [Body("b", cube())])
        turn = turned(1, (1, 2, 3))
        to = np.eye(4)
        to[:3, :3], to[:3, 3] = turn.T / 2, -turn.T @ [1, 2, 3] / 2  # of an object twice as large
        run = self.run_of(prepared, to=to)
        run.join()
        self.assertIsNone(run.refused)
        prepared.scene.save(self.folder / "scene.json")
        subprocess.check_output(["weft", "record", self.folder / "scene.json", "--embedded",
                                 "--to", "20", "-o", self.folder / "a.weft"])
        with weft.open(self.folder / "a.weft") as recording:
            for sheet in "hung", "falls":
                found = read(self.folder / f"{sheet}.pc2")
                self.assertEqual(len(found), 21)
                for number, points in enumerate(found):
                    wanted = recording.frame(number).sheet(sheet)
                    back = 2 * points @ turn.T + [1, 2, 3]
                    np.testing.assert_allclose(back, wanted, atol=2e-6)

    def test_a_cancelled_run_ends_soon_and_keeps_its_frames(self):
        run = self.run_of(prepare(WORLD, [Cloth("a", level(), "denim_11oz")], []), last=10**6)
        self.wait(run, 5)
        begun = time.monotonic()
        run.cancel()
        run.join()
        self.assertLess(time.monotonic() - begun, 5)
        self.assertIsNone(run.refused)
        self.assertEqual(len(read(self.folder / "a.pc2")), run.newest + 1)
        self.assertEqual(self.server.sessions(), [])

    def test_one_that_is_cancelled_before_it_begins_computes_next_to_nothing(self):
        run = self.run_of(prepare(WORLD, [Cloth("a", level(), "denim_11oz")], []), last=10**6)
        run.cancel()
        run.join()
        self.assertIsNone(run.refused)
        self.assertEqual(self.server.sessions(), [])

    def test_a_fabric_changed_in_a_run_holds_from_a_later_frame_on(self):
        large = level(rows=41, columns=41, spacing=0.02)
        prepared = prepare(WORLD, [Cloth("a", large, "denim_11oz", [0, 40])], [])
        self.run_of(prepared, last=60).join()
        before = read(self.folder / "a.pc2")

        run = self.run_of(prepared, last=60)
        self.wait(run, 3)
        run.set_textile("a", "wool_tropical")
        run.join()
        self.assertEqual(run.troubles(), [])
        after = read(self.folder / "a.pc2")
        equal = (before == after).all(axis=(1, 2))
        changed = int(np.argmin(equal))
        self.assertGreater(changed, 3)
        self.assertTrue(equal[:changed].all())
        self.assertFalse(equal[changed:].any())

    def test_an_unknown_fabric_is_told_and_the_run_goes_on(self):
        run = self.run_of(prepare(WORLD, [Cloth("a", level(), "denim_11oz", [0])], []), last=3000)
        run.set_textile("a", "gold")
        until = time.monotonic() + 30
        said = []
        while not said and time.monotonic() < until:
            time.sleep(0.01)
            said = run.troubles()
        self.assertIn('there is no preset "gold"', said[0])
        run.cancel()
        run.join()
        self.assertIsNone(run.refused)

    def test_a_refused_scene_leaves_the_cache_of_the_one_before(self):
        cloth = Cloth("a", level(), "denim_11oz")
        self.run_of(prepare(WORLD, [cloth], [])).join()
        before = (self.folder / "a.pc2").read_bytes()
        cloth.textile = "gold"
        self.assertIn("gold", str(self.refusal(cloth)))
        self.assertEqual((self.folder / "a.pc2").read_bytes(), before)

    def test_what_is_wrong_with_a_mesh_names_the_object_and_has_the_vertices(self):
        points, triangles = grid()
        loose = Surface(np.vstack([points, [9, 9, 0]]), triangles, None, UPRIGHT)
        refused = self.refusal(Cloth("scarf", loose, "denim_11oz"))
        self.assertEqual((refused.name, refused.vertices), ("scarf", (81,)))
        self.assertIn("scarf: particle 81 is in no triangle", str(refused))

        more = [[*triangles[5][:2], 81]] * 2
        third = Surface(np.vstack([points, [0.02, 0.02, 0]]), np.vstack([triangles, more]), None,
                        UPRIGHT)
        refused = self.refusal(Cloth("scarf", third, "denim_11oz"))
        self.assertTrue(set(triangles[5][:2]) <= set(refused.vertices), refused)

        bent, cut = folded()
        uv = (cut[bent.triangles][:, :, :2] / 3)
        uv[20] = uv[20][::-1]
        bent.uv = uv
        refused = self.refusal(Cloth("scarf", bent, "denim_11oz"))
        self.assertTrue(set(bent.triangles[20]) <= set(refused.vertices), refused)
        self.assertIn("clockwise", str(refused))

    def test_a_scene_of_one_frame_is_as_it_starts(self):
        surface = level()
        run = self.run_of(prepare(WORLD, [Cloth("a", surface, "denim_11oz")], []), last=0)
        run.join()
        self.assertIsNone(run.refused)
        np.testing.assert_allclose(read(self.folder / "a.pc2"), [surface.points], atol=1e-6)

    def test_files_that_cannot_be_written_or_read_are_named(self):
        (self.folder / "a.pc2").mkdir()
        refused = self.refusal(Cloth("a", level(), "denim_11oz"))
        self.assertEqual(str(refused), f"{self.folder}/a.pc2: Is a directory")
        servers = Servers()
        prepared = prepare(WORLD, [Cloth("a", level(), "denim_11oz")], [])
        run = Run(lambda: servers.get("127.0.0.1:1", "/no/token"), prepared, {}, 1)
        run.join()
        self.assertEqual(str(run.refused), "/no/token: No such file or directory")

    def test_an_open_body_is_refused_at_its_hole(self):
        box = cube()
        box.triangles = box.triangles[2:]
        refused = self.refusal(Cloth("scarf", level(), "denim_11oz"), [Body("box", box)])
        self.assertEqual((refused.name, refused.vertices), ("box", (0, 1, 2, 3)))

    def test_values_out_of_bounds_name_object_and_field(self):
        refused = self.refusal(Cloth("scarf", level(), "denim_11oz", friction=-1))
        self.assertRegex(str(refused), "^scarf: textile.friction_coefficient: -1 is not within 0")
        many = self.refusal(Cloth("scarf", level(), "gold", friction=-1, thickness_m=5))
        self.assertRegex(str(many), "1 of [23] problems")

    def test_a_server_that_is_gone_is_told(self):
        self.server._process._child.kill()
        run = self.run_of(prepare(WORLD, [Cloth("a", level(), "denim_11oz")], []))
        run.join()
        self.assertTrue(run.lost)
        self.assertIn("no connection to", str(run.refused))


if __name__ == "__main__":
    unittest.main()
