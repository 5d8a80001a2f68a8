"""The config of a run whose work is next to nothing: what is tested is who does it."""


def tiny(frames: int) -> str:
    """Four strands without a head, so many pictures of 16 x 16 pixels."""
    return f"""\
[scene]
head = "none"
[groom]
source = "swatch"
strands = 4
guides = 2
points = 8
[simulate]
frames = {frames}
settle = "0 s"
[render]
size = [16, 16]
samples = 1
grid = 16
"""
