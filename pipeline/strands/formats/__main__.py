"""The child process of `apart`: reads one file under limits and sends its strands to standard output."""

import os
import sys
from pathlib import Path

from pipeline.errors import InputError
from pipeline.strands.formats.apart import REFUSED, Limits, send
from pipeline.strands.formats.files import read_here


def main(path: Path) -> int:
    """Read a file and send its strands, or say what is wrong with it."""
    with os.fdopen(os.dup(1), "wb") as result:
        os.dup2(2, 1)  # libraries print what they like
        try:
            Limits.of(path).impose()
            send(read_here(path), result)
        except InputError as error:
            result.write(str(error).encode())
            return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
