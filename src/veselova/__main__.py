"""``python -m veselova`` and the command ``veselova``."""

from __future__ import annotations

import os
import signal

__all__ = ["main"]


def main() -> None:
    """Run the command line; an interrupt while it is still loading ends it as quietly as one later."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from veselova.service import cli

    signal.signal(signal.SIGINT, signal.default_int_handler)
    cli.main()


if __name__ == "__main__":
    main()
