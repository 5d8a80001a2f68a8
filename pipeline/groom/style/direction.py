"""Direction: strands grow anew from their roots, combed over the head (see `growth`), and keep their lengths."""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Direction
from pipeline.groom.combing import tangential
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.growth import Sprouts, grown, stretches, swept
from pipeline.groom.style.hair import STEP, Hair, Vectors, cut_to, unit

_TILT, _BEND, _COMB, _JITTER, _WANDER = 0, 1, 2, 10, 20  # uses of chance


def directed(hair: Hair, op: Direction, ground: Ground, chance: Chance) -> Hair:
    """Strands of the same lengths, along the paths of combing."""
    terrain, index = ground.under(op.op), hair.index
    sweep = ground.values(op.sweep, hair)
    standoff = terrain.combing.standoff(hair.root)
    flow = terrain.combing.flow(hair.root, hair.normal, standoff)
    comb = unit(flow + tangential(swept(hair.root, sweep), hair.normal))
    if not len(hair):
        return hair
    steps = int(np.ceil(hair.length.max() / STEP - 1e-9))
    wander = [op.wander * chance.directions(index, _WANDER + 3 * k) for k in range(stretches(steps))]
    own = Sprouts(
        root=hair.root,
        standoff=standoff,
        first=_first_direction(hair, op, ground, chance, comb),
        sweep=sweep,
        layer=ground.values(op.lift, hair) * (0.25 + 0.75 * chance.layer(index)),
        bend=op.bend * (0.8 + 0.4 * chance.uniform(index, _BEND)),
        comb=op.comb * (0.85 + 0.3 * chance.uniform(index, _COMB)),
        length=hair.length,
        wander=np.stack(wander, axis=1),
    )
    points = grown(own, terrain, op.lift_over, steps)
    if hair.points.shape[1] > 2:
        points = cut_to(points, hair.length, hair.points.shape[1])
    return replace(hair, points=points, comb=comb)


def _first_direction(hair: Hair, op: Direction, ground: Ground, chance: Chance, comb: Vectors) -> Vectors:
    index = hair.index
    spread = np.clip(chance.normal(index, _TILT), -2, 2)
    tilt = np.clip(ground.values(op.tilt, hair) + op.tilt_jitter * spread, 0, 1.5)[:, None]
    aside = unit(comb + op.direction_jitter * chance.directions(index, _JITTER))
    return unit(np.cos(tilt) * hair.normal + np.sin(tilt) * aside)
