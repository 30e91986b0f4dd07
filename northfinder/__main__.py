"""``python -m northfinder``."""

from northfinder.cli import main

main()
