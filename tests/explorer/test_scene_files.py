"""Scenes as GLB files, with their motion, out of a real browser."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from explorer_browser import Visit, needs_chromium
from explorer_bundle import EXPLORER
from scipy.spatial.transform import Rotation

import veselova as vs
from veselova.mechanics.results.closed_form_evaluation import neumann_time

pytestmark = needs_chromium

PROBLEMS = {
    preset["name"]: preset["problem"]
    for preset in json.loads((EXPLORER / "src/presets.json").read_text())
}


class Scene:
    """A GLB file, read by hand: what moves in it, by the names of its nodes' paths."""

    def __init__(self, raw: bytes) -> None:
        """Read the header, the scene and the numbers."""
        magic, version, length, size, kind = struct.unpack_from("<4sIII4s", raw)
        assert (magic, version, length, kind) == (b"glTF", 2, len(raw), b"JSON")
        self.scene = json.loads(raw[20 : 20 + size])
        self.data = raw[28 + size :]
        (self.animation,) = self.scene["animations"]

    def read(self, accessor: int) -> Any:
        """Return the numbers of an accessor, (count, width)."""
        one = self.scene["accessors"][accessor]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[one["type"]]
        where = self.scene["bufferViews"][one["bufferView"]]
        start = where.get("byteOffset", 0) + one.get("byteOffset", 0)
        return np.frombuffer(self.data, "<f4", one["count"] * width, start).reshape(-1, width)

    def tracks(self, path: str) -> list[tuple[Any, Any, str]]:
        """Return seconds, values and interpolation of every node that moves so."""
        channels = [one for one in self.animation["channels"] if one["target"]["path"] == path]
        samplers = [self.animation["samplers"][one["sampler"]] for one in channels]
        return [
            (
                self.read(one["input"])[:, 0],
                self.read(one["output"]),
                one.get("interpolation", "LINEAR"),
            )
            for one in samplers
        ]


def scene_of(visit: Visit, folder: Path, preset: str, view: str) -> tuple[Scene, Any, Any]:
    """Return the scene of a view from t = 3 on at speed 2, its seconds, and the frames there."""
    visit.open(f"#preset={preset}&t=3&speed=2&play=0")
    visit.wait_for_ink(view, colours=50, part=0.01)
    button = f'[data-view="{view}"] button:has-text("GLB")'
    scene = Scene(visit.download(button, folder).read_bytes())
    seconds = scene.tracks("translation")[0][0]
    assert (seconds[0], seconds[-1], seconds.size) == (0, 10, 301)
    request = {"problem": PROBLEMS[preset], "times": [float(3 + 2 * s) for s in seconds]}
    answer = httpx2.post(f"{visit.origin}/v1/trajectories", json=request).json()
    return scene, seconds, np.array(answer["series"]["frame"])


@pytest.mark.parametrize(("preset", "view"), [("generic", "body"), ("ball", "ball")])
def test_a_scene_leaves_with_its_motion(
    visit: Visit, tmp_path: Path, preset: str, view: str
) -> None:
    """The frames of the file are those of the engine, to single precision."""
    scene, _, frame = scene_of(visit, tmp_path, preset, view)
    found = scene.tracks("rotation")[0][1]
    # The rows of the attitude in the order e_2, e_3, e_1: the picture has its z upwards.
    truth = Rotation.from_matrix(np.swapaxes(frame[..., [1, 2, 0]], 1, 2))
    assert np.max((Rotation.from_quat(found) * truth.inv()).magnitude()) < 1e-5
    assert np.all(np.sum(found[1:] * found[:-1], axis=1) > 0)
    assert len(scene.scene["meshes"]) >= 3
    if view == "ball":
        # Plane, two arrows and the line go with the ball; the plane by whole meshes.
        ball, plane, mean, momentum, line = scene.tracks("translation")
        assert plane[2] == "STEP"
        assert np.ptp(plane[1] - np.round(plane[1]), axis=0) == pytest.approx(0, abs=1e-6)
        assert np.max(np.abs((ball[1] - plane[1])[:, :2])) <= 0.5 + 1e-5
        for _, places, interpolation in (mean, momentum, line):
            assert interpolation == "LINEAR"
            assert np.ptp(places - ball[1], axis=0) == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("preset", ["generic", "chaplygin", "four"])
def test_a_torus_leaves_with_its_motion(visit: Visit, tmp_path: Path, preset: str) -> None:
    """The point of the file is at the phases that the document has in Python."""
    scene, seconds, _ = scene_of(visit, tmp_path, preset, "torus")
    document = httpx2.post(f"{visit.origin}/v1/closed-forms", json={"problem": PROBLEMS[preset]})
    solution = vs.ClosedForm(document.json())
    times = 3 + 2 * np.asarray(seconds, dtype=float)
    _, z, _ = neumann_time(solution.document, solution.arrays, times)
    ((_, found, interpolation),) = scene.tracks("translation")
    if preset == "four":
        truth = 1.5 * (z % 1) - 0.75
        assert interpolation == "STEP"
        lines = [mesh for mesh in scene.scene["meshes"] if mesh["primitives"][0].get("mode") == 3]
        assert len(lines) > 6  # the path comes in parts: it leaves the cube and enters again
    else:
        u, v = 2 * np.pi * z.T
        r = 0.4 * 1.004
        across = 0.85 + r * np.cos(v)
        truth = np.stack([across * np.cos(u), across * np.sin(u), r * np.sin(v)], axis=1)
        assert interpolation == "LINEAR"
    assert found == pytest.approx(truth, abs=1e-5)


def test_a_body_of_four_dimensions_leaves_as_its_shadow(visit: Visit, tmp_path: Path) -> None:
    """The rods of the file are the edges of a box that the engine's frame turns, in perspective."""
    scene, _, frame = scene_of(visit, tmp_path, "four", "body")
    A = np.array([float(entry) for entry in PROBLEMS["four"]["A"]])
    axes = 0.78 * np.sqrt(A / A.max())
    corners = np.array([[1 if a >> i & 1 else -1 for i in range(4)] for a in range(16)])
    y = (0.62 * axes * corners) @ frame
    points = (y / (1 - 0.42 * y[..., 3:]))[..., [1, 2, 0]]
    edges = [(a, a | 1 << i) for a in range(16) for i in range(4) if not a >> i & 1]
    places, turns, scales = (
        [values for _, values, _ in scene.tracks(name)]
        for name in ("translation", "rotation", "scale")
    )
    assert len(places) == len(edges) == 32
    for k, (a, b) in enumerate(edges):
        middle, half = (points[:, a] + points[:, b]) / 2, (points[:, b] - points[:, a]) / 2
        along = Rotation.from_quat(turns[k]).apply([0, 1, 0]) * scales[k][:, 1:2]
        assert places[k] == pytest.approx(middle, abs=1e-5)
        assert along == pytest.approx(half, abs=1e-5)
    primitives = [mesh["primitives"][0] for mesh in scene.scene["meshes"]]
    assert not [one for one in primitives if one.get("mode") == 1]  # no edges that stand still


@pytest.mark.parametrize("view", ["sphere", "ellipsoid"])
def test_points_of_four_dimensions_leave_with_their_motion(
    visit: Visit, tmp_path: Path, view: str
) -> None:
    scene, _, frame = scene_of(visit, tmp_path, "four", view)
    q = frame[:, :, 0]
    A = np.array([float(entry) for entry in PROBLEMS["four"]["A"]])
    X = A * q / np.sqrt(np.sum(A * q * q, axis=1, keepdims=True) * A.max())
    truth = 1.004 * q[:, :3] if view == "sphere" else X[:, :3]
    assert scene.tracks("translation")[0][1] == pytest.approx(truth, abs=1e-5)
