"""``python -m surfrecon``: the command line."""

from surfrecon.cli import main

if __name__ == "__main__":
    main()
