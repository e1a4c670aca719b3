"""Types as a program sees them; mypy reads it, nothing runs it."""
from typing import Any

import numpy as np
import numpy.typing as npt
import weft

sheet: weft.Sheet = weft.Sheet.grid(3, 3, 0.1, weft.Textile.preset("denim_11oz"))
scene = weft.Scene([sheet], solver=weft.SolverSettings(accuracy="DRAFT"))
with weft.serve() as server:
    session = server.create_session(scene)
    frame: int = session.run(until_frame=3)
    for each in session.frames(encoding="FLOAT64"):
        positions: npt.NDArray[Any] = each.positions
        number: int = each.number
        strain: float = each.stats.largest_strain
    faces = session.topology()["sheet"].triangles
    step: float = session.get().plan.substep_s
    report = server.run_test("DRAPE", weft.Textile.preset("denim_11oz"))
    found: list[float] = [value.found for value in report.values]


async def awaited(server: weft.aio.Server) -> None:
    session = await server.create_session(scene)
    async for each in session.frames(particles=range(3)):
        lowest: np.float64 = each.positions[:, 1].min()
    frame: int = await session.grab(0)
