"""Writes docs/pathtracer.md: the same strands, lights, camera and fibres, path-traced by Mitsuba 3 and drawn by ringlet.

python docs/pathtracer.py [NAME...] makes all pictures, or some of them anew, `--page` writes the page alone from the figures
of pictures that are there; those go to docs/pictures/pathtracer. Mitsuba comes with the dependency group "pathtracer".

Mitsuba's fibres are those of Chiang et al., A Practical and Controllable Hair and Fur Model for Production Path Tracing
(2016), traced with up to 64 segments a path; strands are B-splines by the points of ours (made of Mitsuba's straight
curves, hair that is lit from behind stays dark). Two renderings of different noise are made: their mean is what is shown,
and what they have in common is its contrast without the noise.
"""

import json
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from panels import DOCS, rendered, side_by_side
from PIL import Image
from scipy.ndimage import uniform_filter

from pipeline import cache
from pipeline.body.normals import point_normals
from pipeline.config import load
from pipeline.config.schema import Camera
from pipeline.errors import WRONG_INPUT, InputError
from pipeline.render import pigment
from pipeline.render.chunks import Chunks
from pipeline.render.frame import FrameRenderer
from pipeline.render.geometry import drawn_width, smooth
from pipeline.render.lights import as_directions
from pipeline.render.stage import open_frames
from pipeline.render.tone import develop
from pipeline.validation.pictures import Reference, compare, render
from pipeline.validation.pictures.measures import LUMINANCE
from pipeline.validation.pictures.reference import Body

PICTURES = DOCS / "pictures" / "pathtracer"
FIGURES = PICTURES / "figures.json"
SIZE = 256  # [px]
POSITION, LOOK_AT, VIEW = (0.30, 0.03, 0.80), (0.0, -0.01, 0.0), 0.40  # [m], [m], [rad]
SAMPLES = 48
SEGMENTS, ROULETTE = 64, 24  # of a path at most, and from which on it may end by chance
ALBEDO = 0.35  # of the head, here a matte grey for both
SUBDIVIDE = 2  # drawn segments a segment
QUALITY = 90


@dataclass(frozen=True)
class Scene:
    """A config with few strands."""

    config: str
    strands: int
    says: str


SCENES = {
    "blond": Scene("wavy", 5000, "Waves of light hair: most of the light has passed through many fibres."),
    "brown": Scene("default", 5000, "The default style."),
    "black": Scene("bob", 5000, "Black, sleek hair: what is seen is the highlight."),
}

_PAGE = """# Beside a path tracer

The same strands, camera, lights, fibres and head, in linear light: left as Mitsuba 3 path-traces them ({paths} paths a pixel, up
to {segments} segments each), right as ringlet draws them. Nothing is fitted to a scene. Figures are those of pixels that hair covers
wholly; noise is taken out of Mitsuba's contrast (it is what two renderings have in common). Made by `make pathtracer`, which needs
Mitsuba (`pip install --group pathtracer`); [How near frames are to path-traced hair](shading.md) has the
same comparison with Cycles.

| scene | mean by the path tracer's, R G B | correlation of 17 px means | contrast: ours, Mitsuba's | 99th percentile by the mean: ours, Mitsuba's | seconds: ours, Mitsuba's |
|---|---|---|---|---|---|
{rows}

Seconds are those of a machine with two cores, ours with all preparation and a second picture of what hair covers.
{sections}
## What differs, and why

* **Colour.** Means are 2 % above to 11 % below the path tracer's; least is the blue of blond hair. Part of that is Mitsuba's own: it is
  some 5 % brighter than Cycles on the same strands, for it gives each point of a fibre the mean over the fibre's width.
* **Glints in the rim light.** Where light from behind grazes single fibres at the outline, single pixels of the path tracer's
  are many times brighter than those beside them. We take such light from the mean of the hair around, so that the outline has
  an even sheen: the 99th percentile of black hair tells the difference.
* **Light that is scattered many times** is that of an even layer of hair here, and of the strands as they lie in the path tracer. A layer
  has no sides, through which light leaves hair that stands open.
* **The head** is matte there and shines a little here (our skin has a gloss); shadows of single strands on it are sharp there and as wide as light
  spreads in skin here. It takes light from the hair in both, but gives some back to the hair only there.
* **Noise** is all the path tracer's.
"""


def main(wanted: list[str]) -> None:
    """Make the pictures that are wanted, all by default, and write the page of all."""
    figures = json.loads(FIGURES.read_text()) if FIGURES.is_file() else {}
    if wanted != ["--page"]:
        for name in wanted or SCENES:
            figures[name] = picture(name)
            FIGURES.write_text(json.dumps(figures, indent=1) + "\n")
    (DOCS / "pathtracer.md").write_text(page(figures))


def picture(name: str) -> dict[str, Any]:
    """Render a scene both ways, write both side by side, and measure how far they are apart."""
    mitsuba = library()
    reference = scene(name)
    start = time.perf_counter()
    ours, covered = render(reference)
    drawing = time.perf_counter() - start
    start = time.perf_counter()
    halves = trace(mitsuba, reference)
    tracing = time.perf_counter() - start
    traced = (halves[0] + halves[1]) / 2
    hair = covered > 0.95
    found = compare(ours, traced, hair)
    with tempfile.TemporaryDirectory() as folder:
        panels = [Path(folder) / f"{side}.png" for side in ("traced", "ours")]
        for panel, linear in zip(panels, (traced, ours), strict=True):
            Image.fromarray(develop(linear, 1.25, "soft", 8)).save(panel)
        side_by_side(panels, PICTURES / f"{name}.webp", QUALITY)
    return {
        "ratio": found.ratio,
        "correlation": found.correlation,
        "contrast": (found.contrast[0], common_contrast(halves, hair)),
        "highlights": found.highlights,
        "seconds": (drawing, tracing),
        "strands": len(reference.strands),
    }


def scene(name: str) -> Reference:
    """What a config shows in its first frame, with a matte head and fibres that are all alike."""
    wanted = SCENES[name]
    config_file = DOCS.parent / "configs" / f"{wanted.config}.toml"
    settings = (
        "simulate.frames=1",
        f"groom.strands={wanted.strands}",
        f"interpolate.strands={wanted.strands}",
        f"render.size=[{SIZE}, {SIZE}]",
        f"scene.camera.position={list(POSITION)}",
        f"scene.camera.look_at={list(LOOK_AT)}",
        f"scene.camera.field_of_view={VIEW}",
        "render.taper=0",
        "render.hair.melanin_jitter=0",
    )
    experiment = f"pathtracer-{name}"
    rendered(config_file, experiment, settings, (1,))
    config = load(config_file, (f"name={experiment}", *settings)).config
    with open_frames(config, cache.Experiment(DOCS.parent / "outputs" / experiment), "") as frames:
        strands, bodies = drawn(frames.renderer, frames.source.read(1, 0))
        view = frames.path.at(1.0)
    empty = np.zeros((SIZE, SIZE, 4), np.float32)
    return Reference(
        name=name,
        strands=strands,
        width=drawn_width(config.render, len(strands)),
        fibre=config.render.hair,
        camera=Camera(
            position=tuple(view.position),
            look_at=tuple(view.look_at),
            up=tuple(view.up),
            field_of_view=view.field_of_view,
        ),
        lights=tuple(light.model_copy(update={"softness": 0.0}) for light in config.scene.lights),
        environment=config.scene.environment,
        bodies=bodies,
        smooth=empty,
        noisy=empty,
    )


def drawn(renderer: FrameRenderer, moment: Any) -> tuple[np.ndarray, tuple[Body, ...]]:
    """Strands (S, P, 3) [m] and bodies of a moment as they are drawn."""
    chunks = Chunks(renderer.strands, renderer.count)
    chunks.move(moment.guides, moment.pose, moment.moved)
    strands = smooth(np.concatenate([points.copy() for _, points in chunks]), SUBDIVIDE)
    skin = moment.skin or renderer.skin
    if skin is None:
        return strands, ()
    points = (skin.points @ moment.pose[:3, :3].T + moment.pose[:3, 3]).astype(np.float32)
    return strands, (Body(points, skin.triangles, ALBEDO),)


def library() -> Any:
    """Mitsuba, in its variant for any processor. Raises InputError without it."""
    try:
        import mitsuba
    except ImportError:
        raise InputError(
            "docs/pathtracer.py: Mitsuba is not installed; pip install --group pathtracer"
        ) from None
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def trace(mitsuba: Any, reference: Reference) -> list[np.ndarray]:
    """Two renderings (H, W, 3) of different noise, linear RGB over black."""
    with tempfile.TemporaryDirectory() as folder:
        curves = Path(folder) / "strands.txt"
        write_curves(curves, reference)
        world = mitsuba.load_dict(description(mitsuba, reference, curves))
        return [np.array(mitsuba.render(world, seed=seed))[..., :3] for seed in (1, 2)]


def write_curves(path: Path, reference: Reference) -> None:
    """Strands as Mitsuba reads them: x y z radius a line, an empty line between strands.

    At the tip of the last one it reads a point further than there are (3.9), so another one follows, too fine to be seen.
    """
    last = reference.strands.mean(axis=(0, 1)) + 1e-4 * np.arange(4)[:, None]
    with path.open("w") as file:
        for strand, radius in [*((each, reference.width / 2) for each in reference.strands), (last, 1e-8)]:
            file.writelines(f"{x:.7f} {y:.7f} {z:.7f} {radius:.8f}\n" for x, y, z in strand)
            file.write("\n")


def description(mitsuba: Any, reference: Reference, curves: Path) -> dict[str, Any]:
    """The scene in Mitsuba's words."""
    camera = reference.camera
    look = mitsuba.ScalarTransform4f().look_at(
        origin=list(camera.position), target=list(camera.look_at), up=list(camera.up)
    )
    film = {
        "type": "hdrfilm",
        "width": SIZE,
        "height": SIZE,
        "rfilter": {"type": "box"},
        "pixel_format": "rgba",
    }
    said: dict[str, Any] = {
        "type": "scene",
        "integrator": {
            "type": "path",
            "max_depth": SEGMENTS,
            "rr_depth": ROULETTE,
            "hide_emitters": True,
        },
        "sensor": {
            "type": "perspective",
            "fov": float(np.degrees(camera.field_of_view)),
            "fov_axis": "y",
            "to_world": look,
            "film": film,
            "sampler": {"type": "independent", "sample_count": SAMPLES},
        },
        "hair": {"type": "bsplinecurve", "filename": str(curves), "bsdf": hair(reference)},
        "sky": {"type": "constant", "radiance": colour(reference.environment)},
    }
    for i, (direction, irradiance) in enumerate(zip(*as_directions(reference.lights), strict=True)):
        said[f"light{i}"] = {
            "type": "directional",
            "direction": (-direction).tolist(),
            "irradiance": colour(irradiance),
        }
    for i, body in enumerate(reference.bodies):
        said[f"body{i}"] = mesh(mitsuba, body)
    return said


def hair(reference: Reference) -> dict[str, Any]:
    """The fibre: absorption is per radius in both; scales that lean to the tip have a negative angle in Mitsuba."""
    own = reference.fibre
    return {
        "type": "hair",
        "sigma_a": colour(pigment.table(own)[0, 0, :3].astype(np.float64)),  # with the dye; no strand differs
        "longitudinal_roughness": own.roughness,
        "azimuthal_roughness": own.azimuthal_roughness,
        "scale_tilt": -float(np.degrees(own.tilt)),
        "int_ior": 1.55,
        "ext_ior": 1.0,
    }


def mesh(mitsuba: Any, body: Body) -> Any:
    """A matte body with smooth normals."""
    matte = {"type": "diffuse", "reflectance": {"type": "rgb", "value": float(body.albedo)}}
    properties = mitsuba.Properties()
    properties["bsdf"] = mitsuba.load_dict({"type": "twosided", "matte": matte})
    made = mitsuba.Mesh(
        "body", len(body.points), len(body.triangles), has_vertex_normals=True, props=properties
    )
    arrays = mitsuba.traverse(made)
    arrays["vertex_positions"] = body.points.ravel()
    arrays["faces"] = body.triangles.ravel().astype(np.uint32)
    arrays["vertex_normals"] = point_normals(body.points, body.triangles).astype(np.float32).ravel()
    arrays.update()
    return made


def colour(values: Any) -> dict[str, Any]:
    """Linear RGB in Mitsuba's words."""
    return {"type": "rgb", "value": [float(value) for value in np.asarray(values).reshape(3)]}


def common_contrast(halves: list[np.ndarray], mask: np.ndarray, region: int = 17) -> float:
    """Contrast of what two pictures of different noise have in common, as `compare` measures that of one."""
    weight = np.maximum(uniform_filter(mask.astype(np.float64), region), 1e-9)
    light = [half.astype(np.float64) @ LUMINANCE for half in halves]
    left = [each - uniform_filter(each * mask, region) / weight for each in light]
    common = float((left[0] * left[1])[mask].mean())
    return float(np.sqrt(max(common, 0)) / np.mean([each[mask].mean() for each in light]))


def page(figures: dict[str, Any]) -> str:
    """The text of the page."""
    there = [name for name in SCENES if name in figures]
    rows = [row(name, figures[name]) for name in there]
    sections = [
        f"\n## {name}\n\n[`configs/{SCENES[name].config}.toml`](../configs/{SCENES[name].config}.toml) with {figures[name]['strands']:,} "
        f"strands. {SCENES[name].says}\n\n![{name}](pictures/pathtracer/{name}.webp)\n"
        for name in there
    ]
    return _PAGE.format(
        paths=2 * SAMPLES,
        segments=SEGMENTS,
        rows="\n".join(rows),
        sections="".join(sections),
    )


def row(name: str, found: dict[str, Any]) -> str:
    """A line of the table."""
    ratio = " ".join(f"{value:.2f}" for value in found["ratio"])
    pairs = [", ".join(f"{value:.2f}" for value in found[key]) for key in ("contrast", "highlights")]
    seconds = f"{found['seconds'][0]:.1f}, {found['seconds'][1]:.0f}"
    return f"| {name} | {ratio} | {found['correlation']:.3f} | {pairs[0]} | {pairs[1]} | {seconds} |"


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        print(error, file=sys.stderr)
        raise SystemExit(WRONG_INPUT) from None
