"""What a client sees that has nothing of Weft's but its address, or its .proto files.

BIN (the programs), STUBS (generated Python) and WELL_KNOWN (a descriptor set of health, reflection
and google.rpc) come from the environment.
"""
import array
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import grpc
import zstd
from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

DOMAIN = "weft.v1"
SECONDS = 120  # that no call takes
BIN = pathlib.Path(os.environ["BIN"])


def pool_of(files):
    """A pool of FileDescriptorProtos in whatever order."""
    pool = descriptor_pool.DescriptorPool()
    waiting = {file.name: file for file in files}

    def add(name):
        file = waiting.pop(name, None)
        if file is None:
            return
        for needed in file.dependency:
            add(needed)
        pool.Add(file)

    for name in list(waiting):
        add(name)
    return pool


class Protos:
    """Messages and calls, made from descriptors alone."""

    def __init__(self, pool, channel=None):
        self.pool = pool
        self.factory = message_factory.MessageFactory(pool)
        self.channel = channel

    def new(self, name, /, **fields):
        message = self.factory.GetPrototype(self.pool.FindMessageTypeByName(name))()
        return json_format.ParseDict(fields, message, descriptor_pool=self.pool)

    def call(self, method, request=None, /, **fields):
        """The answer, or a list of them, of "package.Service.Method"."""
        service, name = method.rsplit(".", 1)
        found = self.pool.FindServiceByName(service).FindMethodByName(name)
        if request is None:
            request = self.new(found.input_type.full_name, **fields)
        streams = method_streams(found)
        kind = "_".join("stream" if s else "unary" for s in streams)
        ends = dict(
            request_serializer=lambda message: message.SerializeToString(),
            response_deserializer=self.factory.GetPrototype(found.output_type).FromString,
        )
        invoke = getattr(self.channel, kind)(f"/{service}/{name}", **ends)
        answer = invoke(iter([request]) if streams[0] else request, timeout=SECONDS)
        return list(answer) if streams[1] else answer


def method_streams(method):
    proto = descriptor_pb2.MethodDescriptorProto()
    method.CopyToProto(proto)
    return proto.client_streaming, proto.server_streaming


class Weftd(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = subprocess.Popen(
            [BIN / "weftd", "--port=0", "--data-dir=none"], stdout=subprocess.PIPE, text=True)
        cls.addClassCleanup(cls.end)
        cls.address = cls.server.stdout.readline().split()[-1]
        cls.channel = grpc.insecure_channel(cls.address)
        well_known = descriptor_pb2.FileDescriptorSet.FromString(
            pathlib.Path(os.environ["WELL_KNOWN"]).read_bytes())
        cls.well_known = Protos(pool_of(well_known.file), cls.channel)
        cls.services = [s.name for s in cls.reflect(list_services="*").list_services_response.service]
        files = {}
        for service in cls.services:
            if service.startswith("weft."):
                answer = cls.reflect(file_containing_symbol=service).file_descriptor_response
                for file in answer.file_descriptor_proto:
                    proto = descriptor_pb2.FileDescriptorProto.FromString(file)
                    files[proto.name] = proto
        cls.weft = Protos(pool_of(files.values()), cls.channel)
        cls.scene_text = subprocess.check_output(
            [BIN / "weft", "scene", "new", "--template=hang", "--rows=5", "--columns=6"], text=True)
        cls.scene = json_format.Parse(cls.scene_text, cls.weft.new("weft.v1.Scene"))

    @classmethod
    def end(cls):
        cls.server.terminate()
        assert cls.server.wait(SECONDS) == 0
        cls.server.stdout.close()

    @classmethod
    def reflect(cls, **fields):
        return cls.well_known.call(
            "grpc.reflection.v1alpha.ServerReflection.ServerReflectionInfo", **fields)[0]

    def refusal(self, method, /, **fields):
        """Code, reason, metadata and bad fields of a call that must fail."""
        with self.assertRaises(grpc.RpcError) as caught:
            self.weft.call(method, **fields)
        return self.explain(caught.exception)

    def explain(self, error):
        details = dict(error.trailing_metadata())["grpc-status-details-bin"]
        status = self.well_known.new("google.rpc.Status")
        status.ParseFromString(details)
        self.assertEqual(status.code, error.code().value[0])
        found = {}
        for detail in status.details:
            name = detail.TypeName()
            found[name] = self.well_known.new(name)
            found[name].ParseFromString(detail.value)
        info = found["google.rpc.ErrorInfo"]
        self.assertEqual(info.domain, DOMAIN)
        bad = found.get("google.rpc.BadRequest")
        fields = [violation.field for violation in bad.field_violations] if bad else []
        return error.code(), info.reason, dict(info.metadata), fields

    def create(self, name):
        request = self.weft.new("weft.v1.CreateSessionRequest", sessionId=name)
        request.session.scene.CopyFrom(self.scene)
        return self.weft.call("weft.v1.SessionService.CreateSession", request)

    def test_every_service_is_listed_and_healthy(self):
        names = [name for name in self.services if name.startswith("weft.v1.")]
        self.assertGreaterEqual(len(names), 5)
        for service in [""] + names:
            answer = self.well_known.call("grpc.health.v1.Health.Check", service=service)
            self.assertEqual(answer.status, 1, service)

    def test_every_method_answers_or_says_why_not(self):
        methods = 0
        for service in self.services:
            if not service.startswith("weft."):
                continue
            for method in self.weft.pool.FindServiceByName(service).methods:
                methods += 1
                try:
                    self.weft.call(method.full_name)
                except grpc.RpcError as error:
                    code, reason, _, fields = self.explain(error)
                    self.assertEqual(code, grpc.StatusCode.INVALID_ARGUMENT, method.full_name)
                    self.assertTrue(reason == "FIELD_INVALID" and fields, method.full_name)
        self.assertGreaterEqual(methods, 14)

    def test_sessions_live_change_and_end(self):
        sessions = "weft.v1.SessionService."
        session = self.create("life")
        self.assertEqual(session.name, "sessions/life")
        step = self.weft.call(sessions + "StepSession", name=session.name, frames=3)
        self.assertEqual((step.applied_frame, step.frame), (1, 3))
        changed = self.weft.call(
            sessions + "UpdateTextile", name=session.name,
            textile={"measured": {"bendRigidityWarpNM": 1e-4}},
            updateMask="measured.bendRigidityWarpNM")
        self.assertEqual(changed.applied_frame, 4)
        self.assertEqual(changed.textile.measured.bend_rigidity_warp_n_m, 1e-4)
        run = self.weft.call(sessions + "RunSession", name=session.name, timeScale=1)
        self.assertEqual(run.applied_frame, 4)
        paused = self.weft.call(sessions + "PauseSession", name=session.name)
        shown = self.weft.call(sessions + "GetSession", name=session.name)
        self.assertEqual(shown.frame + 1, paused.applied_frame)
        listed = self.weft.call(sessions + "ListSessions").sessions
        self.assertIn(session.name, [each.name for each in listed])
        self.weft.call(sessions + "DeleteSession", name=session.name)
        self.assertEqual(
            self.refusal(sessions + "GetSession", name=session.name)[:2],
            (grpc.StatusCode.NOT_FOUND, "SESSION_NOT_FOUND"))

    def test_errors_name_code_reason_and_fields(self):
        sessions = "weft.v1.SessionService."
        session = self.create("wrong")
        invalid = grpc.StatusCode.INVALID_ARGUMENT
        code, reason, _, fields = self.refusal(sessions + "CreateSession", session={
            "scene": {"sheets": [{"grid": {"rows": 1}}]}})
        self.assertEqual((code, reason), (invalid, "FIELD_INVALID"))
        self.assertIn("session.scene.sheets[0].grid.rows", fields)
        self.assertEqual(
            self.refusal(sessions + "StepSession", name=session.name, frames=0)[3], ["frames"])
        self.assertEqual(
            self.refusal(sessions + "StepSession", name=session.name, expectedFrame=7)[:3],
            (grpc.StatusCode.ABORTED, "FRAME_STALE", {"latest_frame": "0"}))
        with self.assertRaises(grpc.RpcError) as taken:
            self.create("wrong")
        self.assertEqual(
            self.explain(taken.exception)[:2],
            (grpc.StatusCode.ALREADY_EXISTS, "SESSION_EXISTS"))
        self.assertEqual(
            self.refusal("weft.v1.FrameService.StreamFrames", session=session.name, uid="other")[:2],
            (grpc.StatusCode.ABORTED, "UID_CHANGED"))
        self.assertEqual(
            self.refusal("weft.v1.TextileService.GetTextile", name="textiles/none")[:2],
            (grpc.StatusCode.NOT_FOUND, "TEXTILE_NOT_FOUND"))

    def test_textiles_tests_and_facts_can_be_read(self):
        textiles = self.weft.call("weft.v1.TextileService.ListTextiles").textiles
        denim = self.weft.call("weft.v1.TextileService.GetTextile", name="textiles/denim_11oz")
        self.assertIn(denim, textiles)
        messages = self.weft.call(
            "weft.v1.LabService.RunTest", test="LAB_TEST_BENDING", textile={"preset": "denim_11oz"},
            spacingsM=[0.01])
        self.assertEqual(messages[0].WhichOneof("message"), "progress")
        self.assertTrue(messages[-1].report.curves)
        info = self.weft.call("weft.v1.ServerService.GetServerInfo")
        self.assertGreater(info.limits.max_sessions, 0)
        self.assertGreater(self.weft.call("weft.v1.ServerService.GetServerStats").uptime_s, 0)

    def test_quantized_positions_can_be_unpacked_as_the_manual_says(self):
        name = self.create("packed").name
        self.weft.call("weft.v1.SessionService.StepSession", name=name, frames=9)
        frames = lambda **format: [message.frame for message in self.weft.call(
            "weft.v1.FrameService.StreamFrames", session=name, startFrame=9, endFrame=9,
            format=format) if message.HasField("frame")]
        exact = array.array("d", frames(encoding="FRAME_ENCODING_FLOAT64")[0].positions_m)
        packed = frames(encoding="FRAME_ENCODING_QUANTIZED_ZSTD", gridStepM=0.001)[0].positions_m
        planes = zstd.decompress(packed)
        values = len(exact)
        self.assertEqual(len(planes) % values, 0)
        steps = 0
        for i in range(values):
            number = int.from_bytes(planes[i::values], "little")
            difference = number >> 1 ^ -(number & 1)
            steps = difference if i % (values // 3) == 0 else steps + difference
            self.assertLessEqual(abs(steps * 0.001 - exact[i]), 0.0005 + 1e-12)

    def test_a_view_shows_the_newest_frame(self):
        name = self.create("seen").name
        self.weft.call("weft.v1.SessionService.StepSession", name=name, frames=9)
        header, shown = self.weft.call("weft.v1.FrameService.ViewFrames", session=name, credits=1)
        self.assertEqual((header.header.start_frame, shown.frame.number), (9, 9))

    def test_a_replay_is_read_as_the_session_that_it_was(self):
        name = self.create("replayed").name
        self.weft.call("weft.v1.SessionService.StepSession", name=name, frames=9)
        read = lambda server: server.call(
            "weft.v1.FrameService.StreamFrames", session=name, startFrame=0, endFrame=9)
        frames = lambda messages: [each.frame for each in messages if each.HasField("frame")]
        live = read(self.weft)
        with tempfile.TemporaryDirectory() as directory:
            file = pathlib.Path(directory) / "replayed.weft"
            subprocess.check_output([BIN / "weft", "--server", self.address, "record", name,
                                     "--from=0", "--to=9", "-o", file])
            replay = subprocess.Popen([BIN / "weft", "replay", file, "--listen=127.0.0.1:0"],
                                      stdout=subprocess.PIPE, text=True)
            try:
                channel = grpc.insecure_channel(replay.stdout.readline().split()[0])
                replayed = read(Protos(self.weft.pool, channel))
            finally:
                replay.terminate()
                replay.communicate(timeout=SECONDS)
        self.assertEqual(replay.returncode, 0)
        self.assertEqual(replayed[0].header, live[0].header)
        self.assertEqual(len(frames(live)), 10)
        self.assertEqual(frames(replayed), frames(live))

    def test_the_readme_s_reader_prints_every_frame(self):
        reader = pathlib.Path(__file__).parent / "read_frames.py"
        shown = reader.read_text().replace("\n", "\n    ").replace("\n    \n", "\n\n").rstrip()
        self.assertIn(shown, (reader.parents[2] / "client" / "README.md").read_text())
        with tempfile.NamedTemporaryFile("w", suffix=".json") as scene:
            scene.write(self.scene_text)
            scene.flush()
            done = subprocess.run(
                [sys.executable, reader, self.address, "read", scene.name, "20"],
                env={**os.environ, "PYTHONPATH": os.environ["STUBS"]}, timeout=SECONDS,
                capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        messages = self.weft.call(
            "weft.v1.FrameService.StreamFrames", session="sessions/read", startFrame=0, endFrame=20)
        sheet = messages[0].header.sheets[0]
        particles = sheet.rows * sheet.columns
        expected = ["created sessions/read"]
        for frame in (message.frame for message in messages if message.HasField("frame")):
            xyz = array.array("f", frame.positions_m)
            self.assertEqual(len(xyz), 3 * particles)
            lowest = min(xyz[particles:2 * particles])
            expected.append(
                f"frame {frame.number}: {particles} particles, the lowest at {lowest:.4f} m")
        self.assertEqual(len(expected), 22)
        self.assertEqual(done.stdout.splitlines(), expected)


if __name__ == "__main__":
    unittest.main()
