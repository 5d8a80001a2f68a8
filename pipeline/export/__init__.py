"""Files for other programs: the frames of an experiment written out, and what is in a groom that comes in."""
