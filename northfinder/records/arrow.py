"""Arrow, on the C library's allocator.

Its own keeps, for each thread that exports, as much as its largest export took: a service that
stands for months would grow by 100 MB. Arrow asks for the name once, when it is imported.
"""

import os

os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")

import pyarrow as pa
from pyarrow import csv, parquet

__all__ = ["csv", "pa", "parquet"]
