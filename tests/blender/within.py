"""Runs in Blender, without a window."""
import pathlib
import subprocess
import sys
import time
import unittest

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from scenes import (  # noqa: E402
    FOLDER, ball, cloth, empty, install, look, open_up, pin, refusal, simulate,
)


def work():
    from weft_blender import simulate

    return simulate


def recorded():
    """What weft records of the scene that was simulated last, frame by frame, m."""
    import weft

    run = work().simulation.run
    run.prepared.scene.save(FOLDER / "scene.json")
    (FOLDER / "a.weft").unlink(missing_ok=True)
    subprocess.check_output(["weft", "record", FOLDER / "scene.json", "--embedded",
                             "--to", str(run.last), "-o", FOLDER / "a.weft"])
    with weft.open(FOLDER / "a.weft") as recording:
        return [recording.positions(frame).copy() for frame in range(run.last + 1)]


class Drapes(unittest.TestCase):
    def setUp(self):
        self.scene = empty()

    def test_blender_shows_what_weft_records_at_every_frame_upright_and_to_scale(self):
        self.scene.frame_start, self.scene.frame_end = 11, 60
        self.scene.render.fps = 24
        self.scene.unit_settings.scale_length = 0.1  # 10 units are 1 m
        ball(radius=3)
        thing = cloth(size=2)
        thing.location, thing.rotation_euler, thing.scale = (1, 1, 4), (0.2, 0.1, 2), (5, 5, 5)
        simulate()
        truth = recorded()
        for number, points in enumerate(truth):
            np.testing.assert_allclose(look(thing, 11 + number) / 10, points, atol=1e-6)
        self.assertLess(truth[-1][:, 2].min(), truth[0][:, 2].min() - 0.1)  # it fell, downward
        np.testing.assert_array_equal(look(thing, 100), look(thing, 60))  # and stays

    def test_what_falls_falls_by_gravity_in_metres_and_frames_of_the_scene(self):
        self.scene.render.fps = 25
        self.scene.unit_settings.scale_length = 0.01  # centimetres
        self.scene.gravity = (0, 3, -4)
        thing = cloth(size=100)
        simulate()
        way = look(thing, 26).mean(axis=0) - look(thing, 1).mean(axis=0)
        np.testing.assert_allclose(way, [0, 150, -200], rtol=0.01, atol=1e-3)  # g t^2 / 2 of 1 s
        self.scene.use_gravity = False
        simulate()
        np.testing.assert_allclose(look(thing, 26), look(thing, 1), atol=1e-4)

    def test_pins_go_where_blender_leads_them(self):
        bpy.ops.object.empty_add()
        hand = bpy.context.object
        thing = cloth()
        thing.parent = hand
        pin(thing, 0, 10)
        for frame, turn, to in (1, 0, 0), (20, 1.5, 0.4):
            hand.rotation_euler[2], hand.location[0] = turn, to
            hand.keyframe_insert("rotation_euler", frame=frame)
            hand.keyframe_insert("location", frame=frame)
        led = [look(thing, frame)[[0, 10]] for frame in range(1, 31)]
        simulate()
        for frame, points in enumerate(led, 1):
            np.testing.assert_allclose(look(thing, frame)[[0, 10]], points, atol=1e-5)
        self.assertGreater(np.ptp(look(thing, 30)[:, 2]), 0.5)  # the rest hangs

    def test_a_body_that_moves_takes_the_cloth_along(self):
        body = ball()
        for frame, height in (1, 0), (30, 0.5):
            body.location[2] = height
            body.keyframe_insert("location", frame=frame)
        thing = cloth()
        thing.location[2] = 0.32
        simulate()
        self.assertGreater(look(thing, 30)[:, 2].max(), 0.75)

    def test_a_body_that_turns_and_grows_takes_the_cloth_along(self):
        body = ball()
        for frame, turn, size in (1, 0, 1), (10, 0, 1), (30, 0.8, 1.3):
            body.rotation_euler[2], body.scale = turn, (size, size, size)
            body.keyframe_insert("rotation_euler", frame=frame)
            body.keyframe_insert("scale", frame=frame)
        thing = cloth()
        thing.location[2] = 0.32
        simulate()
        collider = work().simulation.run.prepared.scene.colliders[0]
        self.assertEqual(len(collider.shape.source.poses.times_s), 30)
        low, high = look(thing, 10), look(thing, 30)
        self.assertGreater(high[:, 2].max(), low[:, 2].max() + 0.08)  # a ball of 0.3
        edge = high[10] - high[0]  # along x at first
        self.assertGreater(np.arctan2(edge[1], edge[0]), 0.2)

    def test_a_wind_field_blows_along_its_z_at_its_strength(self):
        bpy.ops.object.effector_add(type="WIND", rotation=(0, np.pi / 2, 0))
        bpy.context.object.field.strength = 4
        self.scene.use_gravity = False
        thing = cloth()
        thing.rotation_euler[1] = np.pi / 2
        simulate()
        wind = work().simulation.run.prepared.scene.environment.wind.velocity_m_per_s
        np.testing.assert_allclose(wind, [4, 0, 0], atol=1e-6)
        way = look(thing, 30).mean(axis=0) - look(thing, 1).mean(axis=0)
        self.assertGreater(way[0], 0.1)
        self.assertLess(np.abs(way[1:]).max(), 0.01)

    def test_modifiers_before_weft_make_the_cloth_and_shells_dress_it(self):
        thing = cloth(count=5)
        thing.modifiers.new("Finer", "TRIANGULATE")
        thing.modifiers.new("Shell", "SOLIDIFY").thickness = 0.01
        pin(thing, 0)
        simulate()
        self.assertEqual([each.name for each in thing.modifiers], ["Finer", "Weft", "Shell"])
        self.assertEqual(len(look(thing)), 50)
        simulate()  # the old frames are not what it starts from
        np.testing.assert_allclose(look(thing, 1)[:25, 2], 0, atol=1e-6)

    def test_hidden_objects_are_left_out_and_said(self):
        ball().hide_set(True)
        cloth()
        simulate()
        run = work().simulation.run
        self.assertEqual(run.prepared.scene.colliders, [])
        self.assertIn("Ball: is hidden, and left out", run.notes)

    def test_two_cloths_keep_off_each_other_where_asked(self):
        self.scene.weft.cloth_contact = True
        low, high = cloth("Low"), cloth("High")
        high.location[2] = 0.05
        pin(low, *range(121))
        high.weft.thickness = 0.004
        simulate()
        self.assertGreater(look(high, 30)[:, 2].min(), 0.002)


class Working(unittest.TestCase):
    def setUp(self):
        self.scene = empty()
        self.scene.frame_end = 2000
        self.cloth = cloth(count=21)
        pin(self.cloth, 0, 20)

    def begin(self):
        simulation = work().begin(bpy.context)
        self.addCleanup(simulation.run.join)
        self.addCleanup(simulation.run.cancel)
        return simulation

    def wait(self, simulation, frame):
        until = time.monotonic() + 60
        while simulation.run.newest < frame and time.monotonic() < until:
            time.sleep(0.01)
        simulation.show()

    def test_frames_can_be_looked_at_while_others_are_computed(self):
        simulation = self.begin()
        self.wait(simulation, 5)
        self.assertTrue(simulation.run.running)
        self.assertGreaterEqual(self.scene.frame_current, 6)  # it follows
        self.scene.frame_set(3)
        early = look(self.cloth)
        self.wait(simulation, simulation.run.newest + 5)
        self.assertEqual(self.scene.frame_current, 3)  # no longer
        np.testing.assert_array_equal(look(self.cloth), early)
        self.assertLess(look(self.cloth, 5)[:, 2].min(), early[:, 2].min())

    def test_cancel_keeps_the_frames_that_there_are(self):
        simulation = self.begin()
        self.wait(simulation, 5)
        self.assertEqual(bpy.ops.weft.cancel(), {"FINISHED"})
        simulation.run.join()
        self.assertLess(look(self.cloth, 5)[:, 2].min(), -0.01)
        self.assertFalse(bpy.ops.weft.cancel.poll())

    def test_a_fabric_that_is_changed_reaches_the_run(self):
        simulation = self.begin()
        self.wait(simulation, 5)
        self.cloth.weft.textile = "denim_11oz"
        session = simulation.run._session
        until = time.monotonic() + 30
        wanted = session.server.textile("denim_11oz").values
        while time.monotonic() < until:
            if session.scene().sheets[0].textile.model.to_proto() == wanted:
                return
            time.sleep(0.05)
        self.fail("it does not")

    def test_fabrics_are_those_of_the_server(self):
        servers = work().SERVERS
        until = time.monotonic() + 30
        while not servers.textiles(work().server_of(bpy.context)) and time.monotonic() < until:
            time.sleep(0.05)
        names = [name for name, _ in servers.textiles(work().server_of(bpy.context))]
        self.assertIn("wool_tropical", names)
        self.assertNotIn("silk_light", names)  # its sources leave numbers open

    def test_a_server_that_died_is_replaced(self):
        self.scene.frame_end = 3
        simulate()
        work().SERVERS.get()._process._child.kill()
        self.assertIn("no connection", refusal())
        simulate()

    def test_another_file_ends_what_runs(self):
        simulation = self.begin()
        self.wait(simulation, 2)
        empty()
        self.assertFalse(simulation.run.running)
        self.assertIsNone(simulation.run.refused)

    def test_it_comes_and_goes(self):
        bpy.ops.preferences.addon_disable(module="weft_blender")
        self.assertFalse(hasattr(self.cloth, "weft"))
        install()
        self.assertEqual(self.cloth.weft.kind, "CLOTH")  # as the file has it


class Refusals(unittest.TestCase):
    def setUp(self):
        empty()
        self.cloth = cloth("Scarf")

    def selected(self, thing):
        self.assertEqual(bpy.context.object, thing)
        self.assertEqual(thing.mode, "EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        return [each.index for each in thing.data.vertices if each.select]

    def test_a_loose_vertex_is_selected(self):
        self.cloth.data.vertices.add(1)
        ball()
        self.assertIn("Scarf: particle 121 is in no triangle", refusal())
        self.assertEqual(self.selected(self.cloth), [121])

    def test_a_body_that_is_open_is_selected_at_its_hole(self):
        body = ball()
        hole = open_up(body, 100)
        said = refusal()
        self.assertIn("the surface is open there", said)
        self.assertIn("its vertices are selected", said)
        self.assertEqual(self.selected(body), hole)

    def test_a_mesh_that_changes_its_vertices_is_refused(self):
        built = self.cloth.modifiers.new("Build", "BUILD")
        built.frame_start, built.frame_duration = 5, 10
        self.assertRegex(refusal(), "Scarf: has [0-9]+ vertices in frame [0-9]+")

    def test_groups_and_fabrics_that_are_not_there_are_named(self):
        self.cloth.weft.pin_group = "Collar"
        self.assertIn('Scarf: has no vertex group "Collar"', refusal())
        self.cloth.weft.pin_group = ""
        self.cloth.weft.textile = "gold"
        self.assertIn('Scarf: textile.preset: there is no preset "gold"', refusal())

    def test_a_scale_of_nothing_is_named(self):
        self.cloth.scale = (0, 0, 0)
        self.assertIn("Scarf: ", refusal())

    def test_a_scene_without_cloth_says_what_to_do(self):
        self.cloth.weft.kind = "NONE"
        self.assertIn("There is no cloth", refusal())

    def test_playhead_and_modifiers_are_as_before_a_refusal(self):
        bpy.context.scene.frame_set(7)
        shell = self.cloth.modifiers.new("Shell", "SOLIDIFY")
        self.cloth.weft.textile = "gold"
        refusal()
        self.assertTrue(shell.show_viewport)
        self.assertEqual(bpy.context.scene.frame_current, 7)


class Keeping(unittest.TestCase):
    """Ends with a file for without_weft.py."""

    def test_frames_of_a_file_that_was_not_saved_are_baked_beside_it(self):
        scene = empty()
        ball()
        thing = cloth("Scarf")
        thing.location[2] = 0.35
        simulate()
        self.assertFalse((FOLDER / "kept").exists())
        self.assertIn("Save the file first", self.said(bpy.ops.weft.bake))
        (FOLDER / "kept").mkdir()
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "kept" / "drape.blend"))
        self.assertEqual(bpy.ops.weft.bake(), {"FINISHED"})
        self.assertEqual(thing.modifiers["Weft"].filepath, "//weft_drape/Scene-scarf.pc2")
        self.assertFalse(bpy.ops.weft.bake.poll())
        np.save(FOLDER / "truth.npy", [look(thing, frame) for frame in range(1, 31)])
        bpy.ops.wm.save_mainfile()
        before = (FOLDER / "kept/weft_drape/Scene-scarf.pc2").stat().st_mtime_ns
        scene.frame_end = 10
        simulate()  # straight to its place
        self.assertNotEqual((FOLDER / "kept/weft_drape/Scene-scarf.pc2").stat().st_mtime_ns, before)
        scene.frame_end = 30
        simulate()

    def said(self, operator):
        try:
            operator()
        except RuntimeError as wrong:
            return str(wrong)


# Blender has arguments of its own
result = unittest.main(argv=["within"], exit=False).result
work().end()
sys.exit(not result.wasSuccessful())
