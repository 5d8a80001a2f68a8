"""Libraries that not every installation has."""

from pipeline.errors import InputError

_EXTRA = {"pxr": "usd", "alembic3d": "alembic", "imath": "alembic"}


def missing(error: ModuleNotFoundError, what: str) -> InputError:
    """What to say when a library is not there for `what`; any other module that is missing is our own fault."""
    name = (error.name or "").partition(".")[0]
    if name not in _EXTRA:
        raise error
    return InputError(f'{what} needs {name}; install it by: pip install "ringlet[{_EXTRA[name]}]"')
