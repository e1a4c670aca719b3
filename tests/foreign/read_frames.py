"""Runs a scene and prints its frames: read_frames.py 127.0.0.1:7311 drape scene.json 60"""
import array, sys
import grpc
from google.protobuf import json_format
from weft.v1 import frame_pb2, frame_pb2_grpc, session_pb2, session_pb2_grpc

address, name, scene, last = sys.argv[1:]
channel = grpc.insecure_channel(address)
sessions = session_pb2_grpc.SessionServiceStub(channel)
create = session_pb2.CreateSessionRequest(session_id=name)
json_format.Parse(open(scene).read(), create.session.scene)
print("created", sessions.CreateSession(create).name)
run = session_pb2.RunSessionRequest(name="sessions/" + name, until_frame=int(last))
sessions.RunSession(run)

frames = frame_pb2.StreamFramesRequest(session=run.name, start_frame=0, end_frame=run.until_frame)
for message in frame_pb2_grpc.FrameServiceStub(channel).StreamFrames(frames):
    if message.HasField("frame"):  # float32: x of all particles, then y, then z
        xyz = array.array("f", message.frame.positions_m)
        n = len(xyz) // 3
        print(f"frame {message.frame.number}: {n} particles, the lowest at {min(xyz[n:2 * n]):.4f} m")
