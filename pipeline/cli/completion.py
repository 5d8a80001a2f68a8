"""`ringlet completion`: the script by which a shell completes commands, options and their values."""

from typing import Annotated, Literal

from cyclopts import Parameter

from pipeline.cli.base import CHECK_GROUP, app


@app.command(group=CHECK_GROUP)
def completion(
    shell: Annotated[Literal["bash", "zsh", "fish"], Parameter(help="Whose script.")],
) -> None:
    """Print a shell's completion script; the docs on operating ringlet tell where it goes."""
    print(app.generate_completion(prog_name="ringlet", shell=shell), end="")
