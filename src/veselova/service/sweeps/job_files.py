"""The files of jobs: where they are, and how they are written, counted and removed."""

from __future__ import annotations

import contextlib
import shutil
import uuid
from pathlib import Path

from veselova.service.api.atomic_file import atomic_file
from veselova.service.api.private_folder import make_private, own_folder

__all__ = ["JobFiles", "write_whole"]

#: How the folders of removed jobs begin.
_ASIDE = ".removed-"


class JobFiles:
    """The folder of a store, with a folder for each job."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        own_folder(self.folder)

    def chunk_path(self, job_id: str, position: int) -> Path:
        """Return where the table of a chunk is kept."""
        return self.folder / job_id / "chunks" / f"{position:06d}.parquet"

    def result_path(self, job_id: str) -> Path:
        """Return where the table of a finished job is kept."""
        return self.folder / job_id / "summaries.parquet"

    def trajectories_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a running job is kept."""
        return self.folder / job_id / "trajectories.zarr"

    def packed_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a finished job is kept, in one file."""
        return self.folder / job_id / "trajectories.zarr.zip"

    def chunks(self, job_id: str) -> set[int]:
        """Return the positions of the chunks on the disk."""
        found = (self.folder / job_id / "chunks").glob("*.parquet")
        return {int(path.stem) for path in found}

    def size(self, job_id: str) -> int:
        """Return how many bytes a job has on the disk."""
        total = 0
        for path in (self.folder / job_id).rglob("*"):
            with contextlib.suppress(FileNotFoundError):  # a part that was finished meanwhile
                total += path.stat().st_size
        return total

    def set_aside(self, job_id: str) -> Path:
        """Rename the folder of a job, and return where it is until it is removed: whoever asks for
        the job anew writes into a new one.
        """
        aside = self.folder / f"{_ASIDE}{uuid.uuid4().hex}"
        with contextlib.suppress(FileNotFoundError):  # it has nothing
            (self.folder / job_id).rename(aside)
        return aside

    def remove_aside(self) -> None:
        """Remove what was set aside, by processes that died too."""
        for folder in self.folder.glob(f"{_ASIDE}*"):
            shutil.rmtree(folder, ignore_errors=True)

    def remove_parts(self, job_id: str) -> None:
        """Remove what a process that died was in the midst of writing."""
        for path in (self.folder / job_id).rglob("*.part"):
            path.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that a death of the process or the machine leaves it whole or absent."""
    make_private(path.parent)
    with atomic_file(path) as part:
        part.write_bytes(content)
