"""How five fabrics drape (ISO 9073-9), as a picture: drape.py [PICTURE [SPACING_MM]]"""
import sys

import matplotlib.pyplot as plt
import numpy as np

import weft

picture = sys.argv[1] if len(sys.argv) > 1 else "drape.png"
spacing_m = float(sys.argv[2]) / 1000 if len(sys.argv) > 2 else 0.01
fabrics = ["denim_11oz_drape", "cotton_poplin", "wool_tropical_drape", "jersey_interlock",
           "wang_tango_red_jet_set"]

# %% The tests: a disc of 300 mm hangs over one of 180 mm, and light falls on it from above.
found, published = {}, {}
with weft.serve() as server:
    for fabric in fabrics:
        found[fabric] = server.run_test(
            "DRAPE", weft.Textile.preset(fabric), bending=weft.BendingLaw(weft.Isometric()),
            spacings_m=[spacing_m])
        published[fabric] = [each.value for each in server.textile(fabric).properties
                             if each.field == "drape_coefficient_pct"]

# %% The picture: shadows above, coefficients below, published ones as bands.
figure, axes = plt.subplots(2, len(fabrics), figsize=(12, 6), sharey="row")
for (top, below), fabric in zip(axes.T, fabrics):
    coefficient, folds = (value.found for value in found[fabric].values)
    x, z = np.reshape(found[fabric].curves[0].values, (-1, 2)).T * 1000
    top.fill(x, z, color="tab:blue", alpha=0.6)
    top.add_patch(plt.Circle((0, 0), 90, fill=False, linestyle=":"))
    top.set(aspect="equal", xlim=(-150, 150), ylim=(-150, 150),
            title=fabric.replace("_", " "), xlabel=f"{folds:.0f} folds, mm")
    below.bar([0], [coefficient], color="tab:blue", alpha=0.6)
    below.text(0, coefficient + 1, f"{coefficient:.0f}", ha="center")
    for band in published[fabric]:
        low, high = (float(end) for end in (band.split("-") * 2)[:2])
        below.axhspan(low, high, color="tab:orange", alpha=0.2, label="published")
    below.set(xticks=[], ylim=(0, 100))
axes[1, 0].set_ylabel("drape coefficient, %")
figure.savefig(picture, dpi=80, bbox_inches="tight")
