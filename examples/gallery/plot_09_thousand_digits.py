r"""
A thousand digits
=================

The closed form has as many digits as are asked for. Here are a thousand of
:math:`\gamma_1(1)`, with a bound of their error. Fewer digits agree with
them to where they end. Counted, the ten digits are about equally frequent.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

body = vs.Veselova([3, 2, 1], ["0.6", 0, "0.8"], ["0.8", 1, "-0.6"])
precise = vs.solve(body, ["1"], digits=1000, budget_s=600).decimals
text = str(precise.midpoints["q"][0, 0])
radius = precise.radii["q"][0, 0]
print(text[:52], "…", f"± {radius:.1E}")

# %%
# Fewer digits of an independent computation agree to where they end.

rounded = {
    digits: vs.solve(body, ["1"], digits=digits).decimals
    for digits in (30, 50, 200)
}
for digits, answer in rounded.items():
    difference = abs(
        answer.midpoints["q"][0, 0] - precise.midpoints["q"][0, 0]
    )
    print(
        f"{digits:4d} digits asked: differ by {difference:.0E}",
        f"≤ {answer.radii['q'][0, 0]:.0E}",
    )

digits = np.array([int(d) for d in text.split(".")[1][:1000]]).reshape(
    20, 50
)
figure, axes = plt.subplots(
    1, 2, figsize=(12, 4.6), width_ratios=[5, 1], layout="constrained"
)
axes[0].imshow(digits, cmap="Spectral", vmin=-0.5, vmax=9.5, alpha=0.85)
for (row, column), digit in np.ndenumerate(digits):
    axes[0].text(
        column,
        row,
        digit,
        ha="center",
        va="center",
        fontsize=7.5,
        family="monospace",
    )
axes[0].set(
    title=rf"$\gamma_1(1) = {text[:14]}…$, digits after the point",
    xticks=[],
    yticks=[],
)
axes[0].set_xlabel("fifty a line")
counts = np.bincount(digits.ravel(), minlength=10)
axes[1].barh(
    range(10), counts, color=plt.cm.Spectral(np.linspace(0.05, 0.95, 10))
)
axes[1].axvline(100, color="0.4", linewidth=1)
axes[1].set(title="how often", yticks=range(10), xlabel="of 1000")
axes[1].invert_yaxis()
plt.show()
