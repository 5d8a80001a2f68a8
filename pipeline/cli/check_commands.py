"""Commands that check: validate, doctor."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.cli.base import CHECK_GROUP, OUTPUTS, Flag, Json, Outputs, app, print_json, print_table
from pipeline.errors import DONE, FAILED, InputError

_CASE = ("name", "model", "what", "measured", "reference", "error", "tolerance", "verdict")


@app.command(group=CHECK_GROUP)
def validate(
    case: Annotated[
        str,
        Parameter(
            show_default=False, help="Only cases with this in their name, such as cantilever or rotor."
        ),
    ] = "",
    *,
    quick: Annotated[
        bool, Flag, Parameter(help="Short versions of the cases, in less than a minute.")
    ] = False,
    plots: Annotated[Path | None, Parameter(help="Draw pictures into this folder.")] = None,
    page: Annotated[Path | None, Parameter(help="Write a Markdown page with tables and pictures.")] = None,
    json: Json = False,
) -> int:
    """Compare the physics with closed forms and rod equations; exit code 1 outside a tolerance."""
    from pipeline.progress import track
    from pipeline.validation import all_cases, all_laws
    from pipeline.validation.case import MODELS
    from pipeline.validation.page import rows, summary, write_page
    from pipeline.validation.plots import draw, need_matplotlib

    cases = all_cases(quick, case)
    if not cases:
        listed = "; ".join(law.name for law in all_laws())
        raise InputError(
            f"ringlet validate {case}: no such case; there are {listed}; and the models {', '.join(MODELS)}"
        )
    if plots or page:
        need_matplotlib()
    results = []
    with track("validate", len(cases), "case") as bar:
        for each in cases:
            results.append(each.run())
            bar.advance()
    passed = all(result.passed for result in results)
    if json:
        print_json({"passed": passed, "quick": quick, "cases": rows(results)})
    else:
        print_table(rows(results), _CASE)
        print(f"\n{summary(results)}")
    if plots:
        draw(results, plots)
    if page:
        write_page(results, page, quick)
    return DONE if passed else FAILED


@app.command(group=CHECK_GROUP)
def doctor(*, outputs: Outputs = OUTPUTS, json: Json = False) -> int:
    """Check libraries, kernels, OpenGL, memory, disk, limits and clock; tell the command that mends each."""
    from pipeline.cli.doctor import examine

    checks = examine(outputs)
    passed = all(check.passed for check in checks)
    if json:
        print_json({"passed": passed, "checks": [asdict(check) for check in checks]})
        return DONE if passed else FAILED
    for check in checks:
        print(f"{'ok     ' if check.passed else 'MISSING'} {check.name:<16} {check.found}")
        if not check.passed:
            print(f"{'':<25}{check.remedy}")
    return DONE if passed else FAILED
