"""``python -m northfinder.studies > docs/papers.md``: every paper worked through."""

import sys

from northfinder.studies.papers_markdown import papers_markdown
from northfinder.studies.registry import NAMES, run_study

if __name__ == "__main__":
    sys.stdout.write(papers_markdown([run_study(name) for name in NAMES]))
