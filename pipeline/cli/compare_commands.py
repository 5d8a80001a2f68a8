"""Commands about pictures that should be alike: compare, approve."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.cli.base import CHECK_GROUP, Json, app, print_json
from pipeline.errors import DONE, FAILED

RESULTS = Path("outputs/images")


@app.command(group=CHECK_GROUP)
def compare(
    reference: Annotated[Path, Parameter(help="A PNG or EXR file, or a folder of them.")],
    picture: Annotated[Path, Parameter(help="What is compared with it.")],
    *,
    page: Annotated[Path | None, Parameter(help="Write an HTML page that shows the differences.")] = None,
    within: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, help="Accept what another renderer may do, within the limits."
        ),
    ] = False,
    json: Json = False,
) -> int:
    """Compare two pictures or two folders; exit code 1 when a pixel differs, or with --within a limit is passed."""
    from pipeline.compare import Limits
    from pipeline.compare import compare as compare_pictures

    found = compare_pictures(reference, picture, Limits() if within else None)
    if page is not None:
        from pipeline.cache import replacing
        from pipeline.compare.page import comparison_page

        with replacing(page) as temporary:
            temporary.write_text(comparison_page(f"{reference} and {picture}", found.pairs), "utf-8")
    if json:
        print_json(found.as_json())
        return DONE if found.passed else FAILED
    for pair in found.pairs:
        figures = vars(pair.metrics).items() if pair.metrics else ()
        print(f"{pair.name:<16}", "  ".join(f"{name} {value:.5f}" for name, value in figures))
        for reason in pair.reasons:
            print(f"{'':<16} {reason}")
    return DONE if found.passed else FAILED


@app.command(group=CHECK_GROUP)
def approve(
    reason: Annotated[str, Parameter(help="Why the pictures changed; it is written down beside them.")],
    *names: Annotated[str, Parameter(help="Only these golden pictures; all that failed unless given.")],
    results: Annotated[Path, Parameter(help="Folder of the page that pytest wrote.")] = RESULTS,
    everything: Annotated[
        bool,
        Parameter(
            name="--all",
            negative="",
            show_default=False,
            help="Also what differs and passed, as another renderer's.",
        ),
    ] = False,
) -> None:
    """Take the new pictures of the last test run for golden ones."""
    from pipeline.compare.golden import approve as approve_pictures

    taken, count = approve_pictures(results, reason, names, everything)
    print(f"approved {len(taken)} of {count}: {', '.join(taken) or 'nothing failed'}")
