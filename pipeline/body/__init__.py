"""The body that hair grows on, as a mesh: the distance to it, and where its skin carries roots."""
