"""What every stage leaves behind: one HDF5 file that is whole, verified and keyed by what it was made from."""

from pipeline.cache.atomic import replacing, where_writable
from pipeline.cache.columns import Column, ColumnWriter, Damaged
from pipeline.cache.experiment import Experiment
from pipeline.cache.guides import GuidesReader, GuidesWriter, create_guides, open_guides
from pipeline.cache.pictures import picture_record, write_layers, write_picture
from pipeline.cache.segments import Frame, Segments
from pipeline.cache.sharing import Sharing
from pipeline.cache.store import Missing, Reader, Writer, create, open

__all__ = [
    "Column",
    "ColumnWriter",
    "Damaged",
    "Experiment",
    "Frame",
    "GuidesReader",
    "GuidesWriter",
    "Missing",
    "Reader",
    "Segments",
    "Sharing",
    "Writer",
    "create",
    "create_guides",
    "open",
    "open_guides",
    "picture_record",
    "replacing",
    "where_writable",
    "write_layers",
    "write_picture",
]
