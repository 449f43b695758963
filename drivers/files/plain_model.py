"""The base of all tables that people write: a truth value or a text is never taken for a number.

pydantic reads ``true`` as 1 and ``"0.5"`` as 0.5. Who writes that has mistaken one key for another.
"""

from typing import Any

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

_STRICT = frozenset({"float", "bool"})
_NO_SCHEMAS = frozenset({"metadata", "cls", "config"})


def _number(value: object) -> object:
    if isinstance(value, bool | str):
        raise PydanticCustomError("number_type", "Input should be a whole number")
    return value


def _plain(schema: Any) -> Any:  # noqa: ANN401 a tree of dictionaries and lists
    """The schema with every number and truth value taken at its word; whole numbers may have a point."""
    if isinstance(schema, list | tuple):
        return type(schema)(map(_plain, schema))
    if not isinstance(schema, dict):
        return schema
    kind = schema.get("type")
    if kind in _STRICT:
        return {**schema, "strict": True}
    if kind == "int":
        return core_schema.no_info_before_validator_function(_number, schema)
    if kind == "function-before" and schema.get("function", {}).get("function") is _number:
        return schema  # of a model that was read before
    return {
        key: value if key in ("metadata", "cls", "config") else _plain(value) for key, value in schema.items()
    }


class PlainModel(BaseModel):
    """A model whose numbers are numbers and whose truth values are ``true`` or ``false``."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        schema: CoreSchema = _plain(handler(source))
        return schema
