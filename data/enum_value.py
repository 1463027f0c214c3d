"""Values of the protocol's enums, which another program may have said."""

from google.protobuf.internal.enum_type_wrapper import EnumTypeWrapper


def value_name(kinds: EnumTypeWrapper, number: int) -> str:
    """The name of an enum's value, or its number where there is no such value."""
    return kinds.Name(number) if number in kinds.values() else str(number)
