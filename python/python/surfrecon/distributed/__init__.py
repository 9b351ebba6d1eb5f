"""Merges by several processes and machines: tasks over files, on Dask or by any scheduler's array jobs.

A merge is planned once (`Plan.make`): its stages are cut into tasks, each of which reads and leaves files of a folder
that all processes reach. Tasks of a stage need nothing of each other. A task may be done twice, at once too, and again
where it was stopped. Whoever does them, the surface has the bytes of `surfrecon.merge_to_file`.

>>> from surfrecon import distributed
>>> report = distributed.merge("scans/", "surface.ply", client=dask.distributed.Client())
"""

from .client import merge
from .plan import Plan, Stage

__all__ = ["Plan", "Stage", "merge"]
