"""The limits of the service, each an environment variable VESELOVA_<NAME>."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.folders import account_folder, expand_home

#: Bytes of what is stated in MB.
MEGABYTE = 1_000_000


#: Where a Dask scheduler needs no TLS.
_LOOPBACK = ("127.0.0.1", "localhost", "::1")

#: A list with commas between its parts, each of them one of two patterns, or ``*``.
_LIST = r"^\s*(({0}|\*)(\s*,\s*({0}|\*))*)?\s*$"
_ORIGINS = _LIST.format(r"https?://[^/\s?#@*,]+")
_HOSTS = _LIST.format(r"[A-Za-z0-9._-]+|\[?[0-9A-Fa-f:.]+\]?")


class Settings(BaseSettings):
    """Limits that a server holds for its life."""

    model_config = SettingsConfigDict(env_prefix="VESELOVA_", env_ignore_empty=True, frozen=True)

    workers: int = Field(
        default_factory=lambda: os.cpu_count() or 1, ge=1, description="worker processes"
    )
    max_waiting: int = Field(
        default=64,
        ge=0,
        description="requests that may queue for a worker",
    )
    max_budget_s: float = Field(
        default=60.0, gt=0, allow_inf_nan=False, description="longest budget_s, in seconds"
    )
    worker_memory_mb: int = Field(
        default=2048,
        ge=256,
        le=1_000_000_000,
        description="memory of a worker, of sweeps too, in MB of 10⁶ bytes",
    )
    max_body_bytes: int = Field(
        default=1_000_000, ge=1000, description="largest request body (50 000 times as a list)"
    )
    max_dimension: int = Field(default=64, ge=2, description="largest n")
    max_values: int = Field(
        default=16_000_000, ge=1, description="most frame entries in one answer, times × n²"
    )

    allowed_hosts: str = Field(
        default="",
        pattern=_HOSTS,
        description="names and addresses without ports by which requests may call a server that "
        "is bound to loopback or asks for no keys, besides those of loopback, with commas between "
        "them, or *",
    )

    data_dir: Path = Field(
        default_factory=lambda: account_folder("XDG_STATE_HOME", ".local/state"),
        description="folder of the database, of jobs and of large answers",
    )
    database_url: SecretStr = Field(
        default=SecretStr(""),
        description="sqlite:///PATH or postgresql://USER:PASSWORD@HOST/NAME; SQLite in data_dir "
        "when empty",
    )

    dask_scheduler: str = Field(
        default="",
        description="tls://HOST:PORT of a Dask scheduler, with the certificates of Dask's own "
        "settings; workers of this machine when empty",
    )
    sweep_workers: int = Field(
        default_factory=lambda: os.cpu_count() or 1, ge=1, description="worker processes for sweeps"
    )
    max_stored_bytes: int = Field(
        default=20_000_000_000,
        ge=1000,
        description="largest results of all jobs together, counted as promised until a job has "
        "ended",
    )
    retain_jobs_days: float = Field(
        default=30,
        ge=0,
        le=36_525,
        description="days after which ended jobs are forgotten; 0: never",
    )

    keys: Literal["auto", "required", "off"] = Field(
        default="auto",
        description="whether clients must show an API key; auto: unless the server binds to "
        "loopback",
    )
    cors_origins: str = Field(
        default="",
        pattern=_ORIGINS,
        description="origins such as https://example.org whose pages may call the service, with "
        "commas between them, or *",
    )
    root_path: str = Field(
        default="",
        pattern=r"^(/[A-Za-z0-9._~-]+)*$",
        description="prefix that a proxy strips from each path, such as /veselova; addresses in "
        "answers begin with it",
    )
    log_format: Literal["auto", "json", "text"] = Field(
        default="auto", description="format of the log; auto: text on a terminal, else JSON"
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="lowest level logged"
    )

    @field_validator("dask_scheduler")
    @classmethod
    def _is_guarded(cls, address: str) -> str:
        form = urlsplit(address)
        safe = form.scheme == "tls" or (form.scheme == "tcp" and form.hostname in _LOOPBACK)
        if address and not (safe and form.hostname):
            raise ValueError(
                "required an address tls://HOST:PORT, or tcp:// on loopback: whoever reaches a "
                "Dask cluster can run code on it"
            )
        return address

    @field_validator("data_dir")
    @classmethod
    def _is_below_home(cls, folder: Path) -> Path:
        try:
            return expand_home(folder)
        except InvalidInput as error:
            raise ValueError(f"required {error.required}") from None

    @property
    def limits(self) -> dict[str, float]:
        """Return what a client may know: the numbers among the settings."""
        return {
            name: value
            for name, value in self.model_dump().items()
            if isinstance(value, (int, float))
        }
