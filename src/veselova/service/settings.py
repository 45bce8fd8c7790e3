"""The limits of the service, each an environment variable VESELOVA_<NAME>."""

from __future__ import annotations

import os

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

__all__ = ["Settings"]


class Settings(BaseSettings):
    """Limits that a server holds for its life."""

    model_config = SettingsConfigDict(env_prefix="VESELOVA_", frozen=True)

    workers: int = Field(default_factory=lambda: os.cpu_count() or 1, ge=1, description="worker processes")
    max_waiting: int = Field(default=64, ge=0, description="requests that may wait for a worker before others are refused")
    max_budget_s: float = Field(default=60.0, gt=0, description="longest budget_s that a request may ask for, in seconds")
    shutdown_grace_s: int = Field(default=10, ge=0, description="seconds that requests in flight get after SIGTERM")
    max_body_bytes: int = Field(default=4_000_000, ge=1000, description="largest request body")
    max_dimension: int = Field(default=64, ge=2, description="largest n")
    max_times: int = Field(default=100_000, ge=1, description="most times in one request")
    max_values: int = Field(default=4_000_000, ge=1, description="most frame entries in one answer, times × n²")
