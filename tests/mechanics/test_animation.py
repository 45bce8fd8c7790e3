"""Films of a body and of a ball: ``Trajectory.animate``."""

from __future__ import annotations

import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from veselova.mechanics.results import animation

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

TIMES = {"start": 0, "stop": 6, "count": 7}
BODY = vs.Veselova([3, 2, 1], [0.5, 0.5, 0.7], [0.4, 0.3, -0.1], normalize=True)
MATRIX = vs.Veselova([[3, 1, 0], [1, 2, 0], [0, 0, 1]], [1, 0, 0], [0, 1, 1])
RIGID = vs.EulerPoisson([1, 2, 2.5], [0.6, 0, 0.8], [0.1, 1.5, 0.1])
BALL = vs.RubberBall([0.4, 0.6, 0.9], 0.2, 1, [0.6, 0, 0.8], [0.8, 1, -0.6])


@pytest.mark.daily(4)
@pytest.mark.parametrize("problem", [BODY, MATRIX, RIGID, BALL], ids=lambda one: one.system)
def test_a_film_has_its_frames_and_they_move(problem: Any, tmp_path: Path) -> None:
    film = tmp_path / "film.gif"
    vs.solve(problem, TIMES).animate(film, seconds=0.5, frames_per_second=8)
    with Image.open(film) as read:
        assert read.n_frames == 4
        pictures = []
        for k in range(read.n_frames):
            read.seek(k)
            pictures.append(np.asarray(read.convert("RGB"), dtype=float))
    for before, after in pairwise(pictures):
        assert np.mean(np.abs(before - after).max(axis=2) > 40) > 0.003
        assert len(np.unique(after.reshape(-1, 3), axis=0)) > 30


def test_e1_points_upwards_and_omega_is_horizontal() -> None:
    shown = vs.solve(BODY, TIMES)
    turns = animation._in_space(shown.frame)
    assert np.einsum("nij,nj->ni", turns, shown.q) == pytest.approx(np.tile([0, 0, 1], (7, 1)))
    assert np.linalg.det(turns) == pytest.approx(1)
    omega = np.einsum("nij,nj->ni", turns, animation._Omega(shown))
    assert omega[:, 2] == pytest.approx(0, abs=1e-12)
    # ė_i = e_i × Ω in the body, so what is fixed in space stays: q̇ = q × Ω.
    assert np.cross(shown.q, animation._Omega(shown)) == pytest.approx(shown.q_dot)


def test_a_film_is_written_by_the_ffmpeg_of_the_extra_and_says_how_far(tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    film = tmp_path / "film.mp4"
    heard: list[tuple[float, float]] = []
    vs.solve(BODY, TIMES).animate(
        film, seconds=0.5, frames_per_second=10, progress=lambda *step: heard.append(step)
    )
    assert heard[-1][1] == 5
    command = [ffmpeg, "-v", "error", "-i", str(film), "-f", "rawvideo", "-pix_fmt", "gray", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    pictures = np.frombuffer(raw, np.uint8).reshape(5, 512, 512).astype(float)
    assert all(np.abs(np.diff(pictures, axis=0)).max(axis=(1, 2)) > 60)


def test_what_makes_no_film_is_refused_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib.animation import FFMpegWriter

    trajectory = vs.solve(BODY, TIMES)
    with pytest.raises(vs.InvalidInput, match=r"path: required a file name ending in .gif or .mp4"):
        trajectory.animate(tmp_path / "film.avi")
    with pytest.raises(vs.InvalidInput, match="seconds: required a finite number greater than 0"):
        trajectory.animate(tmp_path / "film.gif", seconds=0)
    for path in (None, 3):
        with pytest.raises(vs.InvalidInput, match="path: required the path of a file"):
            trajectory.animate(path)  # type: ignore[arg-type]
    for rate in (5e-324, 10**400, np.ones(2), True):
        with pytest.raises(vs.InvalidInput, match="frames_per_second: required"):
            trajectory.animate(tmp_path / "film.gif", 1, rate)  # type: ignore[arg-type]
    with pytest.raises(vs.InvalidInput, match="at most 10000 frames; given 250000"):
        trajectory.animate(tmp_path / "film.gif", seconds=1e4)
    with pytest.raises(vs.InvalidInput, match="times: required two different times"):
        vs.solve(BODY, [3]).animate(tmp_path / "film.gif")
    flat = vs.Veselova([2, 1.5, 1.2, 1], [0.5] * 4, [0.5, -0.5, 0.3, -0.3])
    with pytest.raises(vs.InvalidInput, match="problem: required a body in three dimensions"):
        vs.solve(flat, TIMES).animate(tmp_path / "film.gif")
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(vs.BackendMissing, match=r"needs ffmpeg.*\[film\].*or write a \.gif"):
        trajectory.animate(tmp_path / "film.mp4")
    assert not list(tmp_path.iterdir())
