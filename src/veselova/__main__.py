"""``python -m veselova`` and the command ``veselova``."""

from __future__ import annotations

import os
import signal
import sys
from typing import NoReturn

__all__ = ["main"]


def main() -> None:
    """Run the command line; an interrupt during loading ends it as quietly as a later one."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    try:
        from veselova.service.cli import main as cli
    except ModuleNotFoundError as error:
        _refuse(error)

    signal.signal(signal.SIGINT, signal.default_int_handler)
    cli.main()


def _refuse(error: ModuleNotFoundError) -> NoReturn:
    """End with the command that installs what the command line is made of."""
    library = (error.name or "").split(".")[0]
    if library in ("", "veselova"):  # a fault of this package
        raise error
    from veselova.mechanics.core.errors import install_extra

    print(
        f"veselova: the command line needs {library}; install it with: {install_extra('service')}",
        file=sys.stderr,
    )
    raise SystemExit(1)


if __name__ == "__main__":
    main()
