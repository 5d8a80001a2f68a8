"""The built-in head: a mannequin that the project modelled itself, as one signed-distance formula.

`head.json` lists ellipsoids and tapered tubes [m], joined in order by a smooth minimum. Head frame: origin midway
between the ear canals, x to the head's left, y up, z out of the face. Mirror symmetry is a fold of x, softened so
that nothing creases on the midline.
"""
