"""Writes skirt.obj: a skirt that stands as a cone; its UV is how it was cut, m."""
import math

ROWS, COLUMNS = 45, 120
WAIST, TOP, LENGTH, SLOPE = 0.14, 1.06, 0.55, math.radians(28)  # m, m, m, from the vertical

lines, apex = [], WAIST / math.sin(SLOPE)
for row in range(ROWS + 1):
    along = LENGTH * row / ROWS
    radius = WAIST + along * math.sin(SLOPE)
    for column in range(COLUMNS + 1):
        angle = 2 * math.pi * column / COLUMNS
        if column < COLUMNS:  # closed at its back
            x, z = -radius * math.sin(angle), -radius * math.cos(angle)
            lines.append(f"v {x:.6f} {TOP - along * math.cos(SLOPE):.6f} {z:.6f}")
        flat = (angle - math.pi) * math.sin(SLOPE)
        u, v = (apex + along) * math.sin(flat), -(apex + along) * math.cos(flat)
        lines.append(f"vt {u:.6f} {v:.6f}")
for row in range(ROWS):
    for column in range(COLUMNS):
        cell = [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)]
        lines.append("f " + " ".join(
            f"{r * COLUMNS + c % COLUMNS + 1}/{r * (COLUMNS + 1) + c + 1}" for r, c in cell))
open("skirt.obj", "w").write("\n".join(lines) + "\n")
