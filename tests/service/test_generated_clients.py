"""Clients that others generate from the OpenAPI document, in Python and in TypeScript, solve a
problem of this server.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import Server
from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.problem_models import SYSTEMS

pytestmark = pytest.mark.slow

#: Versions of the generators: another one is another program, to be looked at when it is taken.
PYTHON_GENERATOR = ["openapi-python-client==0.29.1"]
OVERRIDES = "content_type_overrides: {application/zip: application/octet-stream}"
TYPESCRIPT_GENERATOR = ["openapi-typescript@7.13.0", "openapi-fetch@0.17.0", "typescript@5.9.3"]

PYTHON_PROGRAM = """
import json, sys
from veselova_client import Client
from veselova_client.api.motions import compute_torus, solve_trajectory
from veselova_client.api.service import list_systems
from veselova_client.api.sweeps import create_sweep
from veselova_client.models import SweepRequest, SweepRequestVary, TorusRequest
from veselova_client.models import TrajectoryRequest, VeselovaModel

problem = VeselovaModel("veselova", [3, 2, "1.5", 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"])
with Client(sys.argv[1]) as client:
    body = TrajectoryRequest(problem=problem, times=[0, 1], outputs=["q", "tau1"])
    trajectory = solve_trajectory.sync(client=client, body=body)
    torus = compute_torus.sync(client=client, body=TorusRequest(problem=problem))
    wrong = TrajectoryRequest(problem=problem, times=["x", 0])
    refused = solve_trajectory.sync(client=client, body=wrong)
    sweep = SweepRequest(problem=problem, vary=SweepRequestVary.from_dict({"/A/0": [3, "7/2"]}))
    create_sweep._get_kwargs(body=sweep)
    systems = [item.system for item in list_systems.sync(client=client).systems]
vary, pointer = sweep.to_dict()["vary"], refused.errors[0].pointer
print(json.dumps([trajectory.series["q"], torus.frequencies_t, pointer, vary, systems]))
"""

TYPESCRIPT_PROGRAM = """
import createClient from "openapi-fetch";
import type { components, paths } from "./schema";

declare const process: { argv: string[] };
const client = createClient<paths>({ baseUrl: process.argv[2] });
const problem: components["schemas"]["VeselovaModel"] = {
  system: "veselova",
  A: [3, 2, "1.5", 1],
  q: ["0.5", "0.5", "0.5", "0.5"],
  q_dot: ["1.1", "-0.7", "0.3", "-0.7"],
};
const motion = await client.POST("/v1/trajectories", {
  body: { problem, times: [0, 1], outputs: ["q", "tau1"] },
});
if (motion.error !== undefined || typeof motion.data !== "object") {
  throw new Error(motion.error?.detail);
}
const torus = await client.POST("/v1/tori", { body: { problem } });
const refused = await client.POST("/v1/trajectories", { body: { problem, times: ["x", 0] } });
const sweep: components["schemas"]["SweepRequest"] = { problem, vary: { "/A/0": [3, "7/2"] } };
const systems = await client.GET("/v1/systems");
console.log(JSON.stringify([
  motion.data.series.q,
  torus.data?.frequencies_t,
  refused.error?.errors?.[0].pointer,
  sweep.vary,
  systems.data?.systems.map(({ system }) => system),
]));
"""


def ran(*command: Any, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder, with variables of the environment, and return its end."""
    environment = {**os.environ, **variables}
    return subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
    )


def require_installed(end: subprocess.CompletedProcess[str], what: str) -> None:
    """Skip a test where an installation failed: machines without the registries have
    no generators.
    """
    if end.returncode:
        pytest.skip(f"{what} cannot be installed here: {end.stderr.strip()[-200:]}")


def require_solved(printed: str) -> None:
    """Assert that a generated client got the answers of the example, the pointer of a refusal and
    the systems.
    """
    q, frequencies, pointer, vary, systems = json.loads(printed)
    problem = vs.Veselova(*(BODY4_PROBLEM[name] for name in ("A", "q", "q_dot")))
    np.testing.assert_allclose(q, vs.solve(problem, [0, 1]).q, atol=1e-12)
    np.testing.assert_allclose(frequencies, vs.torus(problem).frequencies_t, atol=1e-11)
    assert pointer == "/times/0"
    assert vary == {"/A/0": [3, "7/2"]}
    assert systems == list(SYSTEMS)


def test_a_generated_python_client_solves_a_problem(server: Server, tmp_path: Path) -> None:
    ran(sys.executable, "-m", "venv", tmp_path / "venv", folder=tmp_path).check_returncode()
    binaries = tmp_path / "venv" / "bin"
    installed = ran(binaries / "pip", "install", "-q", *PYTHON_GENERATOR, folder=tmp_path)
    require_installed(installed, PYTHON_GENERATOR[0])
    (tmp_path / "openapi.json").write_text(server.get("/openapi.json").text)
    (tmp_path / "config.yml").write_text(OVERRIDES)
    asked = "generate --path openapi.json --output-path made --config config.yml --fail-on-warning"
    command, path = (binaries / "openapi-python-client", *shlex.split(asked)), os.environ["PATH"]
    made = ran(*command, folder=tmp_path, PATH=f"{binaries}:{path}")
    assert made.returncode == 0, made.stdout + made.stderr
    end = ran(
        binaries / "python",
        "-c",
        PYTHON_PROGRAM,
        server.url,
        folder=tmp_path,
        PYTHONPATH=str(tmp_path / "made"),
    )
    assert end.returncode == 0, end.stderr
    require_solved(end.stdout)


@pytest.mark.skipif(
    not (shutil.which("npm") and shutil.which("npx")), reason="Node is not installed"
)
def test_a_generated_typescript_client_solves_a_problem(server: Server, tmp_path: Path) -> None:
    installed = ran(
        "npm", "install", "--no-audit", "--no-fund", *TYPESCRIPT_GENERATOR, folder=tmp_path
    )
    require_installed(installed, TYPESCRIPT_GENERATOR[0])
    (tmp_path / "openapi.json").write_text(server.get("/openapi.json").text)
    (tmp_path / "solve.mts").write_text(TYPESCRIPT_PROGRAM)
    # Fields that have a default may be left out of a request; the generator takes them for required
    # ones without the option.
    generate = "openapi-typescript openapi.json --default-non-nullable false -o schema.d.ts"
    compile_ = (
        "tsc --strict --target es2022 --module esnext --moduleResolution bundler "
        "--lib es2022,dom solve.mts"
    )
    for command in (generate, compile_):
        made = ran("npx", *command.split(), folder=tmp_path)
        assert made.returncode == 0, made.stdout + made.stderr
    end = ran("node", "solve.mjs", server.url, folder=tmp_path)
    assert end.returncode == 0, end.stderr
    require_solved(end.stdout)
