"""``python -m veselova``: the command line."""

from veselova.service.cli import main

if __name__ == "__main__":
    main()
