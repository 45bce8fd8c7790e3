"""Pictures, looked at by their pixels and their lines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d

import veselova as vs
from veselova import InvalidInput, Trajectory, solve
from veselova.mechanics.results.plot import STYLES
from veselova.mechanics.results.portrait import COLOURS

START: Any = [0.6, 0.0, 0.8], [0.8, 1.0, -0.6]


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    return solve(vs.VeselovaSO3([0.4, 0.5, 0.6], *START), {"start": 0, "stop": 20, "count": 800})


def pixels(figure: Figure) -> Any:
    """Return the picture as colours 0 … 1, rows from the top, (height, width, 3)."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3] / 255


def colours_at(figure: Figure, axes: Any, points: Any) -> Any:
    """Return the colours of a picture where points in space are seen, (N, 3)."""
    image = pixels(figure)
    x, y, _ = proj3d.proj_transform(*np.transpose(points), axes.get_proj())
    places = np.rint(axes.transData.transform(np.stack([x, y], axis=1))).astype(int)
    return image[image.shape[0] - 1 - places[:, 1], places[:, 0]]


def is_coloured(image: Any, colour: str) -> Any:
    return np.max(np.abs(image - np.array(to_rgb(colour))), axis=-1) < 0.08


@pytest.mark.parametrize("shape", ["sphere", "ellipsoid"])
def test_the_curve_is_above_the_wireframe_and_dim_on_the_far_side(
    shape: str, motion: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    thick: Any = STYLES["screen"]
    monkeypatch.setitem(thick, "lines.linewidth", 4.0)
    if shape == "ellipsoid":
        problem = vs.EllipsoidGeodesic([9, 4, 1], [1, 1, 1], [1, -1, 0.2], normalize=True)
        motion = solve(problem, {"start": 0, "stop": 30, "count": 1500})
    figure = motion.plot(outputs=["portrait"])
    axes: Any = figure.axes[0]
    radii = motion.problem.semiaxes
    points = motion[motion.problem.portrait]
    up, around = np.radians([axes.elev, axes.azim])
    view = [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)]
    facing = points @ view if radii is None else (points / radii**2) @ view
    limit = 0.2 * np.max(np.abs(facing))
    found = colours_at(figure, axes, points)
    blue = is_coloured(found, COLOURS[0])
    # Arrows of the frames cover some of the near points, the near curve some of the far ones.
    assert np.mean(blue[facing > limit]) > 0.75
    assert np.mean(blue[facing < -limit]) < 0.25
    dim = 1 - 0.22 * (1 - np.array(to_rgb(COLOURS[0])))
    assert np.mean(np.max(np.abs(found[facing < -limit] - dim), axis=1) < 0.08) > 0.5


def test_a_panel_goes_into_axes_of_ones_own(motion: Trajectory) -> None:
    figure = Figure(figsize=(8, 4))
    plane, space = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d")
    assert motion.plot(plane) is figure
    assert motion.plot(space) is figure
    assert len(figure.axes) == 2
    assert len(plane.get_lines()) == 3
    half = pixels(figure).shape[1] // 2
    image = pixels(figure)
    for part in (image[:, :half], image[:, half:]):
        assert np.sum(is_coloured(part, COLOURS[0])) > 100
    with pytest.raises(InvalidInput, match="ax: required axes in space"):
        motion.plot(plane, outputs=["portrait"])
    with pytest.raises(InvalidInput, match="outputs: required one of"):
        motion.plot(plane, outputs=["gamma", "drift"])


@pytest.mark.daily(3)
def test_a_picture_for_print_has_the_width_of_a_column_and_cuts_nothing_off(
    motion: Trajectory, tmp_path: Path
) -> None:
    figure = motion.plot(outputs=["portrait", "frame", "drift"], style="print")
    assert figure.get_size_inches()[0] * 25.4 == pytest.approx(86, abs=0.5)
    image = pixels(figure)
    border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert np.all(border == 1)
    sizes = {text.get_fontsize() for axes in figure.axes for text in axes.get_xticklabels()}
    assert max(sizes) <= 8
    figure.savefig(tmp_path / "motion.pdf")
    written = (tmp_path / "motion.pdf").read_bytes()
    assert written.startswith(b"%PDF")
    assert b"/MediaBox" in written
    assert len(written) < 1_000_000


def test_a_ball_has_the_path_of_its_contact_point_seen_from_above() -> None:
    ball = vs.RubberBall([0.4, 0.6, 0.9], 0.2, 1, *START)
    motion = solve(ball, {"start": 0, "stop": 30, "count": 600})
    figure = motion.plot()
    assert len(figure.axes) == 4
    axes = figure.axes[1]
    pixels(figure)
    assert axes.get_aspect() == 1
    x, y = axes.get_lines()[0].get_data()
    assert np.ptp(x) >= np.ptp(y)
    # Seen from above: what turns from e_2 to e_3 turns to the left.
    own, seen = (np.diff(path, axis=0) for path in (motion.position, np.stack([x, y], axis=1)))
    turn = own[:-1, 0] * own[1:, 1] - own[:-1, 1] * own[1:, 0]
    shown = seen[:-1, 0] * seen[1:, 1] - seen[:-1, 1] * seen[1:, 0]
    np.testing.assert_allclose(shown, turn, atol=1e-15)
    assert np.mean(is_coloured(pixels(motion.plot(outputs=["path"])), COLOURS[0])) > 0.002
    with pytest.raises(InvalidInput, match=r"required a ball in three dimensions for .* path"):
        solve(vs.Veselova([3, 2, 1], *START), [0, 1]).plot(outputs=["path"])


def test_comparisons_draw_their_difference_and_take_the_same_options() -> None:
    found = vs.compare(vs.Veselova([3, 2, 1], *START), np.linspace(0, 5, 60))
    figure = found.plot(outputs=["difference"], style="print")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert labels[:2] == [r"$|\Delta q|$", r"$|\Delta \dot q|$"]
    assert labels[-2:] == ["sum of both bounds", "conditioning floor"]
    assert len(found.plot().axes) == 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"outputs": ["gama"]},
            r"outputs\[0\]: required one of Omega, gamma, .*did you mean gamma",
        ),
        ({"outputs": []}, "outputs: required a list of one or more of"),
        ({"outputs": ["difference"]}, "outputs.0.: required one of"),
        ({"outputs": 3}, "outputs: required a list of one or more of"),
        ({"outputs": np.eye(3)}, "outputs.0.: required one of"),
        ({"ax": 3}, "ax: required axes of matplotlib, or None"),
        ({"ax": np.eye(3)}, "ax: required axes of matplotlib, or None"),
        ({"style": "journal"}, "style: required one of screen, print"),
        ({"style": np.eye(3)}, "style: required one of screen, print"),
        ({"style": {"font.size": 7}}, "style: required one of screen, print"),
    ],
)
def test_what_no_picture_has_is_refused(options: Any, message: str, motion: Trajectory) -> None:
    with pytest.raises(InvalidInput, match=message):
        motion.plot(**options)
    assert len(motion.plot(outputs=list(motion)).axes) == len(list(motion))
    body4 = solve(vs.Veselova([4, 3, 2, 1], [1, 0, 0, 0], [0, 1, 0.5, 0]), [0, 1])
    with pytest.raises(InvalidInput, match="three components for the panel portrait; given q of 4"):
        body4.plot(outputs=["portrait"])
