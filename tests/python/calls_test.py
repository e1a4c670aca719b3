"""Every method of the interface, plain and awaited, against a weftd; errors; recordings."""
import asyncio
import dataclasses
import importlib
import inspect
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import typing
import unittest

import grpc
import numpy as np
import weft
from weft import calls, frame, scene, values
from weft.v1 import frame_pb2, session_pb2

from support import FALL, hung, octahedron, triangles


def note_calls(server, used):
    """Notes the requests of the calls that are made."""
    def noting(name, method):
        def call(*arguments, **options):
            used.add(name)
            return method(*arguments, **options)
        return call

    methods = server._link.methods
    for name, method in list(methods.items()):
        methods[name] = noting(name, method)


class Interface(unittest.TestCase):
    def test_calls_of_every_service_are_known(self):
        folder = pathlib.Path(weft.v1.__file__).parent
        modules = [importlib.import_module("weft.v1." + each.stem)
                   for each in folder.glob("*_pb2.py")]
        services = [name for each in modules for name in each.DESCRIPTOR.services_by_name]
        known = [name for each, _ in calls.SERVICES for name in each.DESCRIPTOR.services_by_name]
        self.assertEqual(sorted(services), sorted(known))

    def test_values_have_the_fields_of_their_messages(self):
        kinds = list(values.kinds())
        for kind in kinds:
            descriptor = kind.message.DESCRIPTOR
            expected = set()
            for field in descriptor.fields:
                oneof = field.containing_oneof
                chooses = oneof and len(oneof.fields) > 1 and not oneof.name == "damping"
                expected.add(oneof.name if chooses else field.name)
            found = {kind.oneofs.get(f.name, f.name) for f in dataclasses.fields(kind)}
            self.assertEqual(found, expected, kind.__name__)
            for field in descriptor.fields:
                inner = field.message_type
                if inner and inner.full_name not in values.VECTORS:
                    self.assertIn(inner, [each.message.DESCRIPTOR for each in kinds])


    def test_what_is_awaited_is_called_as_what_is_not(self):
        names = lambda thing: {name for name in vars(thing) if not name.startswith("_")}
        parameters = lambda thing: [
            (each.name, each.kind, each.default, each.annotation)
            for each in inspect.signature(thing).parameters.values()]
        for kind in "Server", "Session", "Hand":
            plain, awaited = getattr(weft, kind), getattr(weft.aio, kind)
            self.assertEqual(names(plain), names(awaited))
            for name in names(plain) - {"address"}:
                self.assertEqual(str(parameters(getattr(plain, name))),
                                 str(parameters(getattr(awaited, name))), name)
        for name in "connect", "serve":
            self.assertEqual(parameters(getattr(weft, name)), parameters(getattr(weft.aio, name)))

    def test_words_are_those_of_the_enums(self):
        enums = {}
        for messages, _ in [*calls.SERVICES, (weft.v1.scene_pb2, None)]:
            enums.update(messages.DESCRIPTOR.enum_types_by_name)
        for name in ["Evaluator", "Accuracy", "Integrator", "Precision", "StepBound", "LabTest", "LabDirection",
                     "LabMesh", "Encoding"]:
            enum = enums["FrameEncoding" if name == "Encoding" else name]
            prefix = enum.values[0].name.removesuffix("UNSPECIFIED")
            words = typing.get_args(getattr(frame if name == "Encoding" else scene, name))
            self.assertEqual(list(words), [v.name.removeprefix(prefix) for v in enum.values[1:]])


class Plain(unittest.TestCase):
    """All methods, one after the other; the last test says which were left out."""

    @classmethod
    def setUpClass(cls):
        cls.server = weft.serve()
        cls.addClassCleanup(cls.server.close)
        cls.used = set()
        note_calls(cls.server, cls.used)

    def test_sessions_live_change_and_end(self):
        session = self.server.create_session(hung(), "life")
        self.assertEqual(session.name, "sessions/life")
        self.assertEqual(session.step(3).frame, 3)
        with self.assertRaises(weft.Error) as stale:
            session.step(1, expected_frame=7)
        self.assertEqual((stale.exception.reason, stale.exception.metadata),
                         ("FRAME_STALE", {"latest_frame": "3"}))
        changed = session.set_textile(weft.Textile.preset("denim_11oz"), over=0.1)
        self.assertEqual(changed.applied_frame, 4)
        session.set_textile(
            weft.Textile(weft.MeasuredTextile(0, 0, 0, 30)), fields=["measured.shear_n_per_m"])
        session.step(10)
        textile = session.scene().sheets[0].textile.model
        self.assertEqual(textile.shear_n_per_m, 30)
        self.assertAlmostEqual(textile.areal_density_kg_per_m2, 0.4, delta=0.1)
        self.assertEqual(session.run(time_scale=1), 14)
        self.assertEqual(session.pause(), session.get().frame + 1)
        verdict = session.verdict()
        self.assertEqual((verdict.frame, verdict.good), (session.get().frame, False))
        self.assertEqual([fault.code for fault in verdict.faults], ["NOT_AT_REST"])
        self.assertIn(session.name, [each.name for each in self.server.sessions()])
        self.assertEqual(self.server.session("life").uid, session.uid)
        session.delete()
        with self.assertRaises(weft.NotFound):
            session.get()

    def test_particles_are_grabbed_led_and_released(self):
        session = self.server.create_session(hung(), "held")
        corner = 10 * 11
        session.grab(corner)
        session.drag(corner, (0.1, -0.2, 0.5), over=0.1)
        session.step(6)
        np.testing.assert_allclose(session.frame().positions[corner], (0.1, -0.2, 0.5), atol=1e-6)
        session.release(corner)
        session.unpin(0)
        session.pin(corner)
        session.step(20)
        here = session.frame().positions
        np.testing.assert_allclose(here[corner], (0.1, -0.2, 0.5), atol=0.02)
        self.assertLess(here[0, 1], -0.01)
        with self.assertRaises(weft.InvalidArgument) as refused:
            session.act(weft.Grab(3), weft.Drag(4, (0, 0, 0)))
        self.assertIn("actions[1].drag.particle", [v.field for v in refused.exception.violations])

    def test_a_hand_lets_go_when_it_ends(self):
        session = self.server.create_session(hung(), "hand")
        with session.hand() as hand:
            hand.grab(60)
            hand.drag(60, (0.3, 0.2, 0.3), over=0.1)
            self.assertEqual(hand.wait(), 1)
            session.step(10)
            hand.release(60)
            hand.grab(60)
            hand.wait()
        session.grab(60)  # which the hand has let go
        np.testing.assert_allclose(session.frame().positions[60], (0.3, 0.2, 0.3), atol=1e-6)
        with session.hand() as hand, self.assertRaises(weft.InvalidArgument) as refused:
            hand.drag(7, (0, 0, 0))
            hand.wait()
        self.assertEqual(refused.exception.violations[0].field, "action.drag.particle")

    def test_colliders_are_moved(self):
        ball = weft.Collider(weft.Sphere(0.1, center_m=(0, -1, 0)), name="ball")
        session = self.server.create_session(weft.Scene(FALL.sheets, [ball]))
        self.assertEqual(session.move_collider((0, 0.5, 0), over=0.1, collider="ball"), 1)

    def test_bodies_are_led_through_their_poses(self):
        corners, faces = octahedron(0.2)
        poses = weft.Poses([0, 1], [corners, corners + [0, 0.5, 0]])
        body = weft.Collider.mesh(corners, faces, poses=poses, name="body")
        session = self.server.create_session(weft.Scene(FALL.sheets, [body]))
        self.assertEqual(session.pose_collider(0.5, speed=2, collider="body"), 1)
        session.step(20)
        self.assertEqual(list(session.frame().stats.pose_times_s), [0.5])
        with self.assertRaises(weft.InvalidArgument) as refused:
            session.pose_collider(2)
        self.assertEqual(
            refused.exception.violations[0].field, "actions[0].pose_collider.pose_time_s"
        )

    def test_a_session_relaxes_to_the_rest_of_its_scene(self):
        session = self.server.create_session(hung())
        self.assertEqual(session.relax(), 1)
        session.run(until_rest=True)
        session.wait()
        self.assertTrue(session.get().at_rest)
        self.assertLess(session.get().residual, 1e-3)

    def test_a_scene_with_a_refused_warning_makes_no_session(self):
        codes = ["TANGLED_START", "NO_SELF_COLLISION"]
        with self.assertRaises(weft.InvalidArgument) as refused:
            self.server.create_session(FALL, refused_warnings=codes)
        self.assertEqual(refused.exception.violations[0].field, "session.scene")
        self.server.check(FALL, refused_warnings=codes[:1])

    def test_a_session_goes_on_from_a_snapshot(self):
        session = self.server.create_session(hung(), "kept")
        session.step(10)
        snapshot = session.snapshot("ten")
        self.assertEqual([each.name for each in session.snapshots()], [snapshot.name])
        other = self.server.restore(snapshot.name, "other")
        for each in session, other:
            each.step(10)
        np.testing.assert_array_equal(
            session.frame(20).positions, other.frame(20).positions)

    def test_frames_come_once_and_end_with_the_run(self):
        session = self.server.create_session(FALL)
        session.run(until_frame=40)
        self.assertEqual([each.number for each in session.frames()], list(range(41)))
        self.assertEqual(list(session.frames()), [])
        session.step(2)
        self.assertEqual([each.number for each in session.frames()], [41, 42])
        self.assertEqual([each.number for each in session.frames(7, 9)], [7, 8, 9])
        session.run(until_frame=300, time_scale=10)
        self.assertEqual(session.wait().frame, 300)

    def test_frames_hold_what_is_asked_for(self):
        session = self.server.create_session(hung(7, 9))
        session.step(30)
        exact = session.frame(30, encoding="FLOAT64", velocities=True, normals=True, strain=True)
        self.assertEqual(exact.positions.dtype, np.float64)
        self.assertEqual(exact.strain.shape, (2 * 6 * 8, 3))
        np.testing.assert_allclose(np.linalg.norm(exact.normals, axis=1), 1)
        self.assertGreater(np.abs(exact.velocities).max(), 0.1)
        self.assertEqual(exact.sheet().shape, (7, 9, 3))
        np.testing.assert_array_equal(exact.sheet("sheet")[2, 3], exact.positions[2 * 9 + 3])
        self.assertGreater(exact.stats.largest_strain, 0)

        ball = weft.Collider(weft.Sphere(0.1, center_m=(0, -1, 0)), name="ball")
        near = self.server.create_session(weft.Scene(FALL.sheets, [ball]))
        for encoding, within in ("FLOAT64", 1e-12), ("QUANTIZED_ZSTD", 1e-4):
            frame = near.frame(0, encoding=encoding, pressure=True, clearance=True)
            self.assertEqual(frame.pressure.shape, (len(frame.positions),))
            away = np.linalg.norm(frame.positions - (0, -1, 0), axis=1) - 0.1
            np.testing.assert_allclose(frame.clearance, away, rtol=0, atol=within)

        single = session.frame(30)
        self.assertIs(single.velocities, None)
        self.assertIs(single.clearance, None)
        self.assertEqual(single.positions.dtype, np.float32)
        self.assertFalse(single.positions.flags.owndata)
        np.testing.assert_array_equal(single.positions, exact.positions.astype(np.float32))

        for step in 1e-4, 1e-3:
            packed = session.frame(30, encoding="QUANTIZED_ZSTD", grid_step_m=step, velocities=True)
            np.testing.assert_allclose(
                packed.positions, exact.positions, rtol=0, atol=step / 2 + 1e-12)
            np.testing.assert_allclose(
                packed.velocities, exact.velocities, rtol=0, atol=step / 2 + 1e-12)

        some = range(3, 63, 7)
        np.testing.assert_array_equal(
            session.frame(30, particles=some).positions, single.positions[list(some)])

    def test_a_view_shows_the_newest_frame(self):
        session = self.server.create_session(FALL)
        session.step(5)
        view = session.view()
        self.assertEqual(next(view).number, 5)
        session.step(5)
        shown = next(view)
        self.assertEqual((shown.number, shown.skipped), (10, 4))
        view.close()

    def test_large_meshes_go_up_as_assets_and_come_back(self):
        vertices, faces, uv = triangles(110, 110, 0.01)
        mesh = weft.MeshData(vertices, faces, uv)
        self.assertGreater(len(calls.mesh_data(mesh)), 256 << 10)
        asset = self.server.upload(mesh)
        self.assertEqual(asset.mesh.particles, 110 * 110)
        self.assertEqual(self.server.upload(mesh), asset)
        self.assertEqual(self.server.asset(asset.name), asset)
        self.assertIn(asset, self.server.assets())
        self.assertEqual(self.server.download(asset.name), mesh)
        self.server.delete_asset(asset.name)
        self.assertNotIn(asset, self.server.assets())

        most, calls.MOST_INLINE = calls.MOST_INLINE, 1000
        try:
            denim = weft.Textile.preset("denim_11oz")
            small = weft.Sheet.mesh(*triangles(12, 12, 0.02), textile=denim)
            session = self.server.create_session(
                weft.Scene([small], [weft.Collider.mesh(*octahedron(0.2), cell_m=0.02)]))
            name = session.scene().sheets[0].shape.source
            self.assertEqual(
                self.server.download(name).to_proto(), small.shape.source.to_proto())
            sheet = session.topology()["sheet"]
            np.testing.assert_array_equal(sheet.triangles, small.shape.source.triangles)

            open_mesh = weft.Collider.mesh(octahedron(0.2)[0], 50 * octahedron(1)[1][:4])
            with self.assertRaises(weft.InvalidArgument) as refused:
                self.server.check(weft.Scene([small], [open_mesh]))
            fields = [each.field for each in refused.exception.violations]
            self.assertTrue(fields)
            for field in fields:
                self.assertTrue(field.startswith("colliders[0].mesh."), field)
        finally:
            calls.MOST_INLINE = most

    def test_bodies_move_through_poses(self):
        corners, faces = octahedron(0.2)
        lifted = weft.Poses([0.1, 0.3], [corners, corners + [0, 0.1, 0]])
        body = weft.MeshData(None, faces, poses=lifted)
        asset = self.server.upload(body)
        self.assertEqual((asset.mesh.poses, asset.mesh.particles), (2, 6))
        self.assertEqual(self.server.download(asset.name), body)

        patch = weft.Sheet.mesh(*triangles(5, 5, 0.01), textile=weft.Textile.preset("denim_11oz"),
                                placement=weft.Placement((-0.02, 0.202, -0.02)))
        session = self.server.create_session(
            weft.Scene([patch], [weft.Collider(weft.BodyMesh(asset.name, 0.01), name="ram")]))
        session.step(24)
        self.assertGreater(session.frame(24).positions[12, 1], 0.28)
        with self.assertRaises(weft.InvalidArgument) as refused:
            self.server.check(weft.Scene([patch], [weft.Collider.mesh(
                corners, faces, poses=weft.Poses([1, 1], [corners, corners]))]))
        self.assertEqual([each.field for each in refused.exception.violations],
                         ["colliders[0].mesh.data.poses.times_s[1]"])

    def test_textiles_tests_and_facts_can_be_read(self):
        denim = self.server.textile("denim_11oz")
        self.assertIn(denim, self.server.textiles())
        heard = []
        report = self.server.run_test(
            "BENDING", weft.Textile.preset("denim_11oz"), spacings_m=[0.01], progress=heard.append)
        self.assertTrue(report.curves and heard)
        self.assertGreater(self.server.info().limits.max_sessions, 0)
        self.assertGreater(self.server.stats().uptime_s, 0)

    def test_patterns_are_cut_and_sewn(self):
        outline = [weft.PatternEdge([corner]) for corner in ((0.3, 0), (0.3, 0.2), (0, 0.2), (0, 0))]
        tube = weft.Pattern(
            [weft.PatternPanel("tube", outline,
                               creases=[weft.PatternCrease([(0.1, 0), (0.1, 0.2)], 2, 1)])],
            [weft.PatternSeam([weft.EdgeRun("tube", 1)], [weft.EdgeRun("tube", 3)])])
        self.assertEqual(weft.Pattern.from_json(tube.to_json()), tube)
        built = self.server.build_garment(tube, 0.02)
        self.assertEqual(list(built.edges[1].particles), list(built.edges[3].particles)[::-1])
        sheet = weft.Sheet.from_proto(built.sheet)
        fold, = sheet.shape.source.folds
        self.assertEqual(list(fold.particles), list(built.creases[0].particles))
        sheet.textile = weft.Textile.preset("denim_11oz")
        self.server.check(weft.Scene([sheet]))
        tube.panels[0].edges[2].points_m = [(0, float("nan"))]
        with self.assertRaises(weft.InvalidArgument) as refused:
            self.server.build_garment(tube)
        self.assertEqual(refused.exception.violations[0].field,
                         "pattern.panels[0].edges[2].points_m")

    def test_a_tube_is_put_on_a_pole(self):
        half = 0.1
        outline = [(half, -0.05), (half, 0.05), (-half, 0.05), (-half, -0.05)]
        edges = [weft.PatternEdge([corner]) for corner in outline]
        edges[2].label = "waist"
        back = weft.Placement(origin_m=(0, 0, -0.07), rotation=(0, 0, 1, 0))
        front = weft.Placement(origin_m=(0, 0, 0.07))
        sides = [weft.PatternSeam([weft.EdgeRun("front", mine)], [weft.EdgeRun("back", theirs)])
                 for mine, theirs in ((1, 3), (3, 1))]
        tube = weft.Pattern([weft.PatternPanel("front", edges, placement=front),
                             weft.PatternPanel("back", edges, placement=back)], sides)
        pole = weft.Collider(weft.Capsule(0.062, (0, -0.2, 0), (0, 0.2, 0)),
                             friction_coefficient=0.5)
        with tempfile.TemporaryDirectory() as directory:
            tube.save(f"{directory}/tube.json")
            worn = self.server.drape(weft.Pattern.load(f"{directory}/tube.json"), [pole],
                                     weft.Textile.preset("jersey_interlock"), edge_m=0.02,
                                     deflate_m=0.002, accuracy="DRAFT", seconds=5)
        self.assertEqual(worn.session.get().scene.dressing.deflate_m, 0.002)
        self.assertTrue(worn.verdict.dressed)
        self.assertEqual(worn.verdict.particles_inside, 0)
        self.assertEqual(worn.frame.number, worn.session.get().frame)
        across = np.hypot(worn.frame.positions[:, 0], worn.frame.positions[:, 2])
        self.assertGreater(across.min(), 0.0618)  # the pole, all around
        self.assertLess(across.max(), 0.068)
        self.assertEqual(len(worn.mesh.positions_m), len(worn.frame.positions))
        worn.session.delete()

    def test_bodies_are_read_from_obj_files(self):
        with tempfile.TemporaryDirectory() as directory:
            file = pathlib.Path(directory, "body.obj")
            file.write_text("# box\nv 0 0 0\nv 1 0 0 # corner\nv 1 1 0\nv 0 1 0\n"
                            "vt 0 0\nf 1/1 2/1 3/1 4/1\nf -1 -2 -3\n")
            mesh = weft.Collider.load(file, name="box").shape.source
            self.assertEqual(np.shape(mesh.positions_m), (4, 3))
            self.assertEqual([list(each) for each in mesh.triangles],
                             [[0, 1, 2], [0, 2, 3], [3, 2, 1]])
            file.write_text("v 0 0\n")
            with self.assertRaises(weft.InvalidArgument):
                weft.Collider.load(file)

    def test_scenes_are_the_scene_files(self):
        with tempfile.TemporaryDirectory() as directory:
            for template in "hang", "sphere", "box", "flag":
                file = f"{directory}/{template}.json"
                subprocess.check_call(["weft", "scene", "new", "-t", template, "-o", file],
                                      stdout=subprocess.DEVNULL)
                read = weft.Scene.load(file)
                plan = self.server.check(read)
                read.save(file + ".copy")
                self.assertEqual(weft.Scene.load(file + ".copy"), read)
                self.assertEqual(self.server.check(weft.Scene.load(file + ".copy")), plan)
                # what the server has filled in is a scene, too
                filled = weft.Scene.from_proto(plan.scene)
                self.assertEqual(filled.to_proto(), plan.scene)

    def test_errors_name_every_field(self):
        sheet = weft.Sheet.grid(1, 31, float("nan"), weft.Textile.preset("denim_11oz"))
        with self.assertRaises(weft.InvalidArgument) as refused:
            self.server.check(weft.Scene([sheet]))
        self.assertEqual(refused.exception.reason, "FIELD_INVALID")
        self.assertEqual([v.field for v in refused.exception.violations],
                         ["sheets[0].grid.rows", "sheets[0].grid.spacing_m"])
        self.assertIn("1 is not within 2 to 4096", str(refused.exception))
        denim = weft.Textile.preset("denim_11oz")
        for wrong, field in [
            (weft.Sheet.grid("31", 31, 0.1, denim), "sheets[0].grid.rows"),
            (weft.Sheet.grid(31, 31, 0.1, denim, placement=weft.Placement((0, 1))),
             "sheets[0].placement.origin_m"),
            (weft.Sheet.mesh([[0, 0]], [[0, 1, 2]], textile=denim),
             "sheets[0].triangles.data.positions_m"),
            (weft.Sheet.grid(31, 31, 0.1, "denim_11oz"), "sheets[0].textile"),
            (weft.Sheet.grid(31, 31, 0.1, weft.Textile("denim_11oz", 1, 1)),
             "sheets[0].textile.damping_ratio"),
            (weft.Sheet.grid(31, 31, 0.1, denim, bending=weft.BendingLaw(weft.ChoiKo("FAST"))),
             "sheets[0].bending.choi_ko.evaluator"),
        ]:
            with self.assertRaises(weft.InvalidArgument) as refused:
                weft.Scene([wrong]).to_proto()
            self.assertEqual(refused.exception.violations[0].field, field)

    def test_recordings_are_read_as_they_were_streamed(self):
        denim = weft.Textile.preset("denim_11oz")
        grid = hung()
        mesh = weft.Scene([weft.Sheet.mesh(*triangles(9, 7, 0.03), textile=denim)])
        with tempfile.TemporaryDirectory() as directory:
            for number, (scene, encoding) in enumerate(
                    [(grid, "float32"), (grid, "float64"), (grid, "quantized"), (mesh, "float32")]):
                file = f"{directory}/{number}.weft"
                session = self.server.create_session(scene, f"recorded-{number}")
                subprocess.check_output(
                    ["weft", "--server", self.server.address, "record", f"recorded-{number}",
                     "--run", "--to=30", "--from=0", f"--encoding={encoding}", "-o", file])
                with weft.open(file) as recording:
                    self.assertEqual((recording.first_frame, len(recording)), (0, 31))
                    self.assertEqual(recording.scene, session.scene())
                    names = {"quantized": "QUANTIZED_ZSTD"}
                    live = session.frames(0, 30, encoding=names.get(encoding, encoding.upper()))
                    for one, other in zip(live, recording):
                        self.assertEqual(one.number, other.number)
                        self.assertEqual(one.stats, other.stats)
                        np.testing.assert_array_equal(one.positions, other.positions)
                    np.testing.assert_array_equal(recording.positions(30), one.positions)
                    self.assertEqual(recording.topology()["sheet"].triangles.tolist(),
                                     session.topology()["sheet"].triangles.tolist())
                    with self.assertRaises(weft.NotFound):
                        recording.frame(31)
            data = pathlib.Path(file).read_bytes()
            at = data.rindex(one.positions.T.tobytes()[:40])
            pathlib.Path(file).write_bytes(data[:at] + b"\0\1\2\3" + data[at + 4:])
            with weft.open(file) as recording, self.assertRaises(weft.Damaged):
                for _ in recording:
                    pass
            pathlib.Path(file).write_bytes(b"no recording" * 1000)
            for wrong, error in (file, weft.InvalidArgument), (file + "x", weft.NotFound):
                with self.assertRaises(error):
                    weft.open(wrong)

    def test_zz_no_call_is_left_out(self):
        self.assertEqual(set(self.server._link.methods) - self.used, set())


class Awaited(unittest.TestCase):
    def test_every_call_can_be_awaited(self):
        used = set()

        async def all_of_them():
            async with weft.aio.serve() as server:
                note_calls(server, used)
                await self.sessions(server)
                await self.meshes(server)
                await self.facts(server)
                self.assertEqual(set(server._link.methods) - used, set())

        asyncio.run(all_of_them())

    async def sessions(self, server):
        await server.check(hung())
        session = await server.create_session(hung(), "life")
        self.assertEqual((await session.step(3)).frame, 3)
        await session.set_textile(weft.Textile.preset("denim_11oz"), over=0.1)
        await session.run(until_frame=30)
        self.assertEqual([each.number async for each in session.frames()], list(range(31)))
        self.assertEqual([each.number async for each in session.frames()], [])
        await session.run(until_frame=40, time_scale=4)
        self.assertEqual((await session.wait()).frame, 40)
        self.assertEqual((await session.frame()).number, 40)
        np.testing.assert_array_equal(
            (await session.frame(40)).positions,
            (await session.frame(encoding="FLOAT64")).positions.astype(np.float32))
        view = session.view()
        self.assertEqual((await view.__anext__()).number, 40)
        await session.step(3)
        self.assertEqual((await view.__anext__()).skipped, 2)
        await view.aclose()
        await session.run(time_scale=1)
        await session.pause()
        self.assertTrue((await session.verdict()).dressed)

        await session.grab(5)
        await session.drag(5, (0, 0, 0), over=0.5)
        await session.release(5)
        await session.pin(7)
        await session.unpin(7)
        async with session.hand() as hand:
            await hand.grab(60)
            await hand.drag(60, (0.3, 0.2, 0.3))
            self.assertGreater(await hand.wait(), 40)
            await hand.release(60)
        with self.assertRaises(weft.InvalidArgument):
            async with session.hand() as hand:
                await hand.drag(7, (0, 0, 0))
                await hand.wait()
        snapshot = await session.snapshot()
        self.assertEqual([each.name for each in await session.snapshots()], [snapshot.name])
        other = await server.restore(snapshot.name)
        self.assertEqual((await other.get()).frame, (await session.get()).frame)
        self.assertEqual(len(await server.sessions()), 2)
        self.assertEqual((await server.session("life")).uid, session.uid)
        self.assertEqual((await session.scene()).sheets[0].shape, hung().sheets[0].shape)
        self.assertEqual((await session.topology())["sheet"].triangles.shape, (200, 3))
        await session.delete()
        with self.assertRaises(weft.NotFound):
            await session.get()
        ball = weft.Collider(weft.Sphere(0.1, center_m=(0, -1, 0)))
        moved = await server.create_session(weft.Scene(FALL.sheets, [ball]))
        await moved.relax()
        await moved.move_collider((0, 0.1, 0))

    async def meshes(self, server):
        mesh = weft.MeshData(*triangles(110, 110, 0.01))
        asset = await server.upload(mesh)
        self.assertEqual(await server.asset(asset.name), asset)
        self.assertIn(asset, await server.assets())
        self.assertEqual(await server.download(asset.name), mesh)
        await server.delete_asset(asset.name)

    async def facts(self, server):
        denim = await server.textile("denim_11oz")
        self.assertIn(denim, await server.textiles())
        report = await server.run_test(
            "BENDING", weft.Textile.preset("denim_11oz"), spacings_m=[0.01])
        self.assertTrue(report.curves)
        corners = [(0.1, 0), (0, 0.1), (0, 0)]
        panel = weft.PatternPanel("kite", [weft.PatternEdge([each]) for each in corners])
        built = await server.build_garment(weft.Pattern([panel]), edge_m=0.05)
        self.assertEqual([len(each.particles) for each in built.edges], [3, 4, 3])
        worn = await server.drape(weft.Pattern([panel]), [], weft.Textile.preset("denim_11oz"),
                                  edge_m=0.05, seconds=0.1)
        self.assertEqual((worn.frame.number, worn.verdict.dressed), (6, False))
        self.assertGreater((await server.info()).limits.max_sessions, 0)
        self.assertGreater((await server.stats()).uptime_s, 0)


class Parts(unittest.TestCase):
    def test_frames_of_several_messages_are_joined(self):
        parts = frame.Parts()
        message = lambda data, more: frame_pb2.Frame(number=3, positions_m=data, continued=more)
        self.assertIs(parts.join(message(b"ab", True)), None)
        self.assertIs(parts.join(message(b"cd", True)), None)
        self.assertEqual(parts.join(message(b"ef", False)).positions_m, b"abcdef")
        self.assertEqual(parts.join(message(b"gh", False)).positions_m, b"gh")
        parts.join(message(b"ab", True))
        with self.assertRaises(weft.Damaged):
            parts.join(frame_pb2.Frame(number=4))


class Attempts(unittest.TestCase):
    """Of several servers, as their answers say."""

    def pause(self, request, code, reason="", **metadata):
        status = weft.errors._message("Status")(code=code.value[0])
        if reason:
            info = weft.errors._message("ErrorInfo")(reason=reason, metadata=metadata)
            status.details.add(type_url="type.googleapis.com/google.rpc.ErrorInfo",
                               value=info.SerializeToString())
        cause = grpc.aio.AioRpcError(code, grpc.aio.Metadata(), grpc.aio.Metadata(
            ("grpc-status-details-bin", status.SerializeToString())), "why")
        link = calls.Link(grpc.insecure_channel("127.0.0.1:1"), "127.0.0.1:1", "word")
        link.reached = True
        attempts = calls.Attempts(link, request)
        try:
            return attempts.pause(cause), dict(attempts.metadata)
        finally:
            link.channel.close()

    def test_are_made_where_that_does_no_harm(self):
        step = session_pb2.StepSessionRequest(name="sessions/flag")
        gone = grpc.StatusCode.UNAVAILABLE
        pause, metadata = self.pause(step, gone, "WRONG_REPLICA", replica="other")
        self.assertEqual(pause, 0)
        self.assertEqual(metadata, {"authorization": "Bearer word", "weft-session": "flag",
                                    "weft-replica": "other"})
        for reason in "", "SERVER_DRAINING", "STORE_UNREACHABLE":
            with self.assertRaises(weft.NoConnection):
                self.pause(step, gone, reason)
            self.assertGreater(self.pause(calls.named(step), gone, reason)[0], 0)
            step.request_id = ""
        for code, reason in [(grpc.StatusCode.NOT_FOUND, "SESSION_NOT_FOUND"),
                             (grpc.StatusCode.DEADLINE_EXCEEDED, "")]:
            with self.assertRaises(weft.Error):
                self.pause(calls.named(step), code, reason)


class Ends(unittest.TestCase):
    def test_a_server_of_one_s_own_does_not_outlive_a_kill(self):
        program = ("import weft, time; s = weft.serve(); print(s.address, flush=True);"
                   "time.sleep(100)")
        child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        host, port = child.stdout.readline().split(":")
        socket.create_connection((host, int(port))).close()
        child.kill()
        child.communicate()
        begin = time.monotonic()
        while True:
            try:
                socket.create_connection((host, int(port))).close()
            except ConnectionRefusedError:
                break
            except ConnectionResetError:
                pass
            self.assertLess(time.monotonic() - begin, 20)
            time.sleep(0.01)

    def test_what_does_not_serve_says_why(self):
        with self.assertRaises(weft.Error) as refused:
            weft.serve(arguments=["--max-streams=0"])
        self.assertIn("--max-streams is 0", str(refused.exception))
        with self.assertRaises(weft.NoConnection) as refused:
            weft.connect("127.0.0.1:1").info()
        self.assertIn("no connection to 127.0.0.1:1", str(refused.exception))
        with self.assertRaises(weft.InvalidArgument):
            weft.connect("cloth.example.org:7311", "word")


class Callers(unittest.TestCase):
    def test_tokens_and_certificates_say_who_calls(self):
        with tempfile.TemporaryDirectory() as directory:
            at = lambda name: f"{directory}/{name}"
            tokens = subprocess.check_output(["weft", "token", "ann", "-o", at("ann")])
            pathlib.Path(at("tokens")).write_bytes(tokens)
            subprocess.check_output(
                ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256",
                 "-nodes", "-subj", "/CN=weftd", "-addext", "subjectAltName=IP:127.0.0.1",
                 "-keyout", at("key"), "-out", at("crt")], stderr=subprocess.DEVNULL)
            token = pathlib.Path(at("ann")).read_text().strip()
            weftd = subprocess.Popen(
                ["weftd", "--port=0", "--data-dir=none", "--log-level=off",
                 f"--tokens={at('tokens')}", f"--tls-cert={at('crt')}", f"--tls-key={at('key')}"],
                stdout=subprocess.PIPE, text=True)
            try:
                address = weftd.stdout.readline().split()[-1]
                with weft.connect(address, token, tls_ca=at("crt")) as server:
                    session = server.create_session(FALL)
                    self.assertEqual(session.get().owner, "ann")
                    session.step(3)
                    self.assertEqual(len(list(session.frames())), 4)
                with weft.connect(address, tls_ca=at("crt")) as server:
                    with self.assertRaises(weft.Error) as refused:
                        server.sessions()
                    self.assertEqual(refused.exception.reason, "TOKEN_MISSING")

                async def awaited():
                    async with weft.aio.connect(address, token, tls_ca=at("crt")) as server:
                        return [each.owner for each in await server.sessions()]

                self.assertEqual(asyncio.run(awaited()), ["ann"])
            finally:
                weftd.terminate()
                weftd.communicate()


if __name__ == "__main__":
    unittest.main()
