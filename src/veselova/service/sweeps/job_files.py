"""The files of jobs: where they are, and how they are written, counted and removed."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path

from veselova.service.api.atomic_file import atomic_file
from veselova.service.api.private_folder import make_private, own_folder

__all__ = ["JobFiles", "write_whole"]


class JobFiles:
    """The folder of a store, with a folder for each job."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        own_folder(self.folder)

    def chunk_path(self, job_id: str, start: int, stop: int) -> Path:
        """Return where the table of the problems start … stop−1 is kept."""
        return self.chunk_folder(job_id) / f"{start:09d}-{stop:09d}.parquet"

    def chunk_folder(self, job_id: str) -> Path:
        """Return the folder of what a job is made of until it has finished."""
        return self.folder / job_id / "chunks"

    def result_path(self, job_id: str) -> Path:
        """Return where the table of a finished job is kept."""
        return self.folder / job_id / "summaries.parquet"

    def packed_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a finished job is kept, in one file."""
        return self.folder / job_id / "trajectories.zarr.zip"

    def chunks(self, job_id: str) -> dict[tuple[int, int], Path]:
        """Return the tables on the disk by their problems (start, stop), in their order."""
        found = sorted(self.chunk_folder(job_id).glob("*-*.parquet"))
        return {(int(path.stem[:9]), int(path.stem[10:])): path for path in found}

    def size(self, job_id: str) -> int:
        """Return how many bytes a job has on the disk."""
        total = 0
        for path in (self.folder / job_id).rglob("*"):
            with contextlib.suppress(FileNotFoundError):  # a part that was finished meanwhile
                total += path.stat().st_size
        return total

    def remove_files(self, job_id: str) -> None:
        """Remove all files of a job."""
        shutil.rmtree(self.folder / job_id, ignore_errors=True)

    def remove_parts(self, job_id: str) -> None:
        """Remove what a process that died was in the midst of writing."""
        for path in (self.folder / job_id).rglob("*.part"):
            path.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that a death of the process or the machine leaves it whole or absent."""
    make_private(path.parent)
    with atomic_file(path) as part:
        part.write_bytes(content)
