"""Stage 2: the guides in motion, from a groom, a material and a moving head."""
