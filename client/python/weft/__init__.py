"""Weft simulates textiles as a service; this is its client.

What is given to a server are the dataclasses of `weft.scene`; what it answers are the messages of
`weft.v1`, whose comments in proto/weft/v1 are the manual. Units are SI and stand in the names.
`weft.aio` has the same to be awaited.
"""
from . import aio, errors, v1
from .client import Drape, Hand, Server, Session, connect, serve
from .errors import Damaged, Error, InvalidArgument, NoConnection, NotFound, Violation
from .frame import Frame
from .recording import Recording, open
from .scene import (
    BendingLaw,
    BodyMesh,
    Box,
    Capsule,
    ChoiKo,
    Collider,
    Drag,
    Dressing,
    EdgeRun,
    Environment,
    Fold,
    Grab,
    Grid,
    Hold,
    Isometric,
    Keyframe,
    MeasuredTextile,
    MeshData,
    MoveCollider,
    Panel,
    Pattern,
    PatternCrease,
    PatternEdge,
    PatternPanel,
    PatternSeam,
    Pin,
    PinParticle,
    Placement,
    Plane,
    PoseCollider,
    Poses,
    RawTextile,
    Relax,
    Release,
    Scene,
    Sheet,
    SolverSettings,
    Sphere,
    Textile,
    TriangleSheet,
    UnpinParticle,
    Wind,
)

__all__ = [
    "BendingLaw", "BodyMesh", "Box", "Capsule", "ChoiKo", "Collider", "Damaged", "Drag",
    "Drape", "Dressing", "EdgeRun", "Environment", "Error", "Fold", "Frame", "Grab", "Grid",
    "Hand", "Hold", "InvalidArgument", "Isometric", "Keyframe", "MeasuredTextile", "MeshData",
    "MoveCollider", "NoConnection", "NotFound", "Panel", "Pattern", "PatternCrease",
    "PatternEdge", "PatternPanel", "PatternSeam", "Pin", "PinParticle", "Placement", "Plane",
    "PoseCollider", "Poses", "RawTextile", "Recording", "Relax", "Release", "Scene", "Server",
    "Session", "Sheet", "SolverSettings", "Sphere", "Textile", "TriangleSheet", "UnpinParticle",
    "Violation", "Wind", "aio", "connect", "errors", "open", "serve", "v1",
]
