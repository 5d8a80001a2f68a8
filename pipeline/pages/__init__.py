"""Building blocks of self-contained HTML pages: escaped markup, one style, pictures inside the file, line plots."""

from pipeline.pages.document import document, table
from pipeline.pages.markup import Html, join, tag
from pipeline.pages.pictures import data_address, shrunk
from pipeline.pages.plots import Line, plot

__all__ = ["Html", "Line", "data_address", "document", "join", "plot", "shrunk", "table", "tag"]
