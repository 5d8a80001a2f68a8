"""Options of a sweep: one config, many experiments."""

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from pipeline.config.schema.base import Section


class Sweep(Section):
    """Beside `mode`, each key is that of an option, in quotes, with the list of its values."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Annotated[list[Any], Field(min_length=1)]]

    mode: Literal["product", "zip"] = "product"
    """"product" takes every combination of the values, "zip" the first of each list, then the second of each, and so on."""
